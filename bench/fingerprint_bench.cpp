// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench fingerprint`: hashes of everything the program computes from a set of scans. Two versions
// that print the same lines give the same segments, signatures, scores, explanations and hits, bit for bit.
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <CLI/CLI.hpp>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include "bench/operations.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "client/io/scan_reader.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/search/top_k.h"
#include "core/signature/signature_codec.h"

namespace shapedb::bench {

namespace {

struct FingerprintFlags {
    std::vector<std::string> paths;
    std::vector<std::string> profiles = {"default", "paper"};
    std::size_t queries = 100;
    unsigned threads = cli::defaultThreads();
};

constexpr std::size_t kHits = 10;
constexpr std::size_t kDigits = 16;

/// A hash of bits: -0.0 and 0.0 differ.
class Digest {
  public:
    template <typename Number>
    void add(Number number) {
        static_assert(std::is_arithmetic_v<Number> || std::is_enum_v<Number>, "no padding");
        hash_.update(&number, sizeof number);
    }
    template <typename Value, typename Allocator>
    void add(const std::vector<Value, Allocator>& values) {
        static_assert(std::is_trivially_copyable_v<Value>);
        add(values.size());
        hash_.update(values.data(), values.size() * sizeof(Value));
    }
    void add(const std::string& text) {
        add(text.size());
        hash_.update(text.data(), text.size());
    }
    std::string finish() { return toHex(hash_.finish()).substr(0, kDigits); }

  private:
    Sha256 hash_;
};

struct Described {
    std::string segmentation;  ///< hash, or the name of the error
    std::string signature;
    std::vector<Signature> made;  ///< one, or none after an error
};

std::string hashOf(const Segmentation& s) {
    Digest digest;
    digest.add(s.pointSegment);
    digest.add(s.tetrahedronSegment);
    digest.add(s.tetrahedra.vertices);
    digest.add(s.tetrahedra.circumradii);
    digest.add(s.sites);
    digest.add(s.siteOfPoint);
    for (const double value : {s.volume, s.size, s.quality, s.angleDegrees, s.noise}) digest.add(value);
    digest.add(s.interiorSource);
    digest.add(s.duplicates);
    digest.add(s.outliers);
    for (const Segment& segment : s.segments) {
        digest.add(segment.volume);
        digest.add(segment.maximumRadius);
        for (const double value : segment.covariance) digest.add(value);
    }
    return digest.finish();
}

Described describeFile(const std::string& path, const ShapeParameters& parameters,
                       const RunContext& context) {
    Described result;
    const auto scan = readScan(path);
    const auto description = scan ? describe(scan->points, parameters, context) : fail(scan.error());
    if (!description) {
        result.segmentation = result.signature = errorCodeName(description.error().code);
        return result;
    }
    Digest digest;
    digest.add(encodeSignature(description->signature));
    result.segmentation = hashOf(description->segmentation);
    result.signature = digest.finish();
    result.made.push_back(description->signature);
    return result;
}

void addExplanation(Digest& digest, const Explanation& why) {
    for (const double value : {why.score, why.similarity, why.dissimilarity, why.motion.scale,
                               why.motion.translation.x, why.motion.translation.y, why.motion.translation.z})
        digest.add(value);
    for (const auto& row : why.motion.rotation) {
        for (const double value : row) digest.add(value);
    }
    for (const PointMatch& match : why.matches) {
        digest.add(match.a);
        digest.add(match.b);
        digest.add(match.share);
        digest.add(match.distance);
    }
    for (const ScoreTerm& term : why.terms) {
        digest.add(std::string(term.name));
        digest.add(term.distance);
        digest.add(term.weight);
    }
    digest.add(why.unmatchedA);
    digest.add(why.unmatchedB);
    digest.add(why.degenerate);
}

/// Every how many-th shape is a query, so that there are at most `queries`.
std::size_t stepFor(std::size_t shapes, std::size_t queries) {
    return std::max<std::size_t>(1, (shapes + queries - 1) / queries);
}

struct ScoreHashes {
    std::string scores, explanations;
};

ScoreHashes hashScores(const std::vector<Signature>& all, std::size_t step, const ScoreOptions& options) {
    struct Row {
        std::string scores, explanations;
    };
    std::vector<Row> rows((all.size() + step - 1) / step);
    tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t row) {
        const std::size_t i = row * step;
        Digest scores, explanations;
        for (std::size_t j = 0; j < all.size(); ++j) {
            scores.add(score(all[i], all[j], options));
            scores.add(scoreUpperBound(all[i], all[j], options));
            // An explanation costs as much as many scores: a few of each row.
            if ((7 * i + j) % 23 == 0) addExplanation(explanations, explain(all[i], all[j], options));
        }
        rows[row] = {scores.finish(), explanations.finish()};
    });
    Digest scores, explanations;
    for (const Row& row : rows) {
        scores.add(row.scores);
        explanations.add(row.explanations);
    }
    return {scores.finish(), explanations.finish()};
}

Result<std::string> hashHits(const std::vector<Signature>& all, const SignatureSet& set, std::size_t step,
                             const ScoreOptions& score, const RunContext& context) {
    SearchOptions options;
    options.score = score;
    options.k = kHits;
    Digest digest;
    for (std::size_t i = 0; i < all.size(); i += step) {
        const auto result = topK(all[i], set, options, context);
        RETURN_IF_ERROR(result);
        for (const SearchHit& hit : result->hits) {
            digest.add(hit.id);
            digest.add(hit.score);
        }
    }
    return digest.finish();
}

std::string nameOf(const ScoreOptions& options) {
    std::string name = options.partial ? "partial" : "whole";
    if (!options.reflection) name += ", no reflection";
    if (options.keepScale) name += ", keep scale";
    return name;
}

Result<void> printProfile(const std::string& name, const std::vector<ScanFile>& files,
                          const FingerprintFlags& flags, Bench& bench) {
    const auto profile = profileFromName(name);
    RETURN_IF_ERROR(profile);
    const ShapeParameters parameters = parametersOf(*profile);
    std::vector<Described> described(files.size());
    tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
        described[i] = describeFile(files[i].path, parameters, bench.context());
    });
    RETURN_IF_ERROR(bench.context().checkpoint());
    std::vector<Signature> all;
    std::vector<IndexEntry> entries;
    Digest segmentations, signatures;
    std::string text;
    for (std::size_t i = 0; i < files.size(); ++i) {
        const Described& one = described[i];
        text += name + " | " + files[i].path + " | segmentation " + one.segmentation + " | signature " +
                one.signature + "\n";
        segmentations.add(one.segmentation);
        signatures.add(one.signature);
        for (const Signature& signature : one.made) {
            all.push_back(signature);
            entries.push_back({static_cast<std::int64_t>(i) + 1, {}, signature});
        }
    }
    text += name + " | all | segmentation " + segmentations.finish() + " | signature " + signatures.finish() +
            "\n";
    bench.console.text(text);

    const SignatureSet set = SignatureSet().with(entries, {});
    const std::size_t step = stepFor(all.size(), flags.queries);
    for (unsigned bits = 0; bits < 8; ++bits) {
        ScoreOptions options;
        options.reflection = (bits & 1U) == 0;
        options.keepScale = (bits & 2U) != 0;
        options.partial = (bits & 4U) != 0;
        const ScoreHashes hashes = hashScores(all, step, options);
        const auto hits = hashHits(all, set, step, options, bench.context());
        RETURN_IF_ERROR(hits);
        bench.console.text(name + " | " + nameOf(options) + " | scores " + hashes.scores +
                           " | explanations " + hashes.explanations + " | hits " + *hits + "\n");
        RETURN_IF_ERROR(bench.context().checkpoint());
    }
    return {};
}

Result<int> runFingerprint(const FingerprintFlags& flags, Bench& bench) {
    const auto files = listScanFiles(flags.paths);
    RETURN_IF_ERROR(files);
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, flags.threads);
    for (const std::string& profile : flags.profiles) {
        RETURN_IF_ERROR(printProfile(profile, *files, flags, bench));
    }
    return cli::kOk;
}

}  // namespace

void addFingerprintOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<FingerprintFlags>();
    CLI::App* command = app.add_subcommand(
        "fingerprint",
        "Hashes of all results from a set of scans, to show that a change keeps them bit for bit");
    command->add_option("PATH", flags->paths, "Scan files and folders")->required();
    command->add_option("--profile", flags->profiles, "Profiles to use: paper, default")
        ->delimiter(',')
        ->check(CLI::IsMember({"paper", "default"}))
        ->type_name("A,B");
    command
        ->add_option("--queries", flags->queries,
                     "At most so many shapes, evenly chosen, are scored against all")
        ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}))
        ->capture_default_str();
    command->add_option("--threads", flags->threads, "Changes no result")->check(CLI::Range(1, 1024));
    command->callback(
        [&bench, flags] { bench.action = [&bench, flags] { return runFingerprint(*flags, bench); }; });
}

}  // namespace shapedb::bench
