// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench topk`: time of exact search among many signatures beside a flat scan of feature vectors, and
// a check that it is exact.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "bench/measuring.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/peers.h"
#include "bench/signature_generator.h"
#include "client/cli/console.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/matching/attributed/statistics_bound.h"
#include "core/matching/score.h"
#include "core/search/top_k.h"

namespace shapedb::bench {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kRounds = 5;
constexpr std::size_t kFullCheck = 20000;      // up to this many shapes every score is computed
constexpr std::size_t kPeerDimension = 640;    // of an ESF descriptor
constexpr std::size_t kMostForPeer = 2000000;  // 5 GB of vectors
constexpr std::size_t kPeerQueries = 5;        // per round
constexpr std::size_t kLoadBatch = 8192;
constexpr std::size_t kPairsForSpread = 4000;

struct TopkFlags {
    std::vector<std::size_t> shapes = {100000};
    std::size_t k = 10;
    std::size_t queries = 100;
    std::string mixture = "plain";
    std::uint64_t seed = 1;
    unsigned threads = 2;
    bool noPeer = false;
    std::string json;
};

double millisecondsSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Runs `work` with that many threads.
template <typename Work>
void withThreads(unsigned threads, const Work& work) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(static_cast<int>(threads));
    arena.execute(work);
}

struct Queries {
    std::vector<Signature> signatures;
    std::vector<SearchResult> results;
};

class TopKRun {
  public:
    TopKRun(const TopkFlags& flags, std::size_t shapes, Mixture mixture, Bench& bench)
        : flags_(flags), shapes_(shapes), mixture_(mixture), bench_(bench) {}

    Result<nlohmann::json> run() {
        auto generator = SignatureGenerator::create({mixture_, shapes_, flags_.seed}, bench_.context());
        RETURN_IF_ERROR(generator);
        generator_.emplace(std::move(*generator));
        options_.k = flags_.k;
        RETURN_IF_ERROR(build());
        queries_.signatures.reserve(flags_.queries);
        // Shapes of the same distribution that are not in the set.
        for (std::size_t q = 0; q < flags_.queries; ++q) {
            queries_.signatures.push_back(generator_->make(shapes_ + 1 + q));
        }
        nlohmann::json out = {{"shapes", shapes_},
                              {"mixture", name(mixture_)},
                              {"classes", generator_->classes()},
                              {"k", flags_.k},
                              {"queries", flags_.queries},
                              {"bytes_per_shape", static_cast<double>(set_.memoryBytes()) / size()},
                              {"seconds_to_build", buildSeconds_}};
        out["spread"] = spread();
        RETURN_IF_ERROR(measure(out));
        addLadder(out);
        RETURN_IF_ERROR(measureBatch(out));
        RETURN_IF_ERROR(check(out));
        return out;
    }

  private:
    double size() const { return static_cast<double>(shapes_); }

    Result<void> build() {
        const auto start = Clock::now();
        for (std::size_t begin = 0; begin < shapes_; begin += kLoadBatch) {
            RETURN_IF_ERROR(bench_.context().checkpoint());
            const std::size_t count = std::min(kLoadBatch, shapes_ - begin);
            std::vector<IndexEntry> entries(count);
            tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
                entries[i].id = static_cast<std::int64_t>(begin + i + 1);
                entries[i].signature = generator_->make(begin + i);
            });
            set_ = set_.with(entries, {});
        }
        buildSeconds_ = millisecondsSince(start) / 1000.0;
        return {};
    }

    // Distances between shapes (D in docs/scoring.md), to compare with real collections.
    nlohmann::json spread() const {
        std::vector<double> within, across;
        Random random(flags_.seed);
        for (std::size_t pair = 0; pair < 20 * kPairsForSpread; ++pair) {
            const std::uint64_t a = random.below(shapes_);
            const std::uint64_t b = random.below(shapes_);
            if (a == b) continue;
            std::vector<double>& kind = generator_->classOf(a) == generator_->classOf(b) ? within : across;
            if (kind.size() >= kPairsForSpread) continue;
            const double value = score(generator_->make(a), generator_->make(b), {});
            kind.push_back(0.5 * std::sqrt(1.0 / value - 1.0));
        }
        const auto quantiles = [](const std::vector<double>& values) {
            nlohmann::json out;
            for (const double q : {0.01, 0.05, 0.25, 0.5, 0.75, 0.95}) {
                out[std::to_string(q).substr(0, 4)] = percentile(values, q);
            }
            return out;
        };
        return {{"within_class", quantiles(within)}, {"across_classes", quantiles(across)}};
    }

    Result<void> searchAll(std::vector<double>* latencies) {
        queries_.results.resize(queries_.signatures.size());
        for (std::size_t q = 0; q < queries_.signatures.size(); ++q) {
            const auto start = Clock::now();
            auto result = topK(queries_.signatures[q], set_, options_, bench_.context());
            RETURN_IF_ERROR(result);
            if (latencies != nullptr) latencies->push_back(millisecondsSince(start));
            queries_.results[q] = std::move(*result);
        }
        return {};
    }

    // Ours and the peer's alternate, so that other load on the machine affects both.
    Result<void> measure(nlohmann::json& out) {
        std::unique_ptr<VectorScan> peer =
            flags_.noPeer || shapes_ > kMostForPeer ? nullptr : makeVectorScan(kPeerDimension);
        std::vector<float> vectors;
        Random random(flags_.seed + 7);
        for (std::size_t begin = 0; peer != nullptr && begin < shapes_; begin += kLoadBatch) {
            const std::size_t count = std::min(kLoadBatch, shapes_ - begin);
            vectors.resize(count * kPeerDimension);
            for (float& v : vectors) v = static_cast<float>(random.uniform());
            peer->add(vectors.data(), count);
        }
        std::vector<double> all, medians, peerMedians, ratios;
        for (std::size_t round = 0; round < kRounds; ++round) {
            std::vector<double> latencies;
            Result<void> done;
            withThreads(flags_.threads, [&] { done = searchAll(&latencies); });
            RETURN_IF_ERROR(done);
            all.insert(all.end(), latencies.begin(), latencies.end());
            medians.push_back(median(latencies));
            if (peer == nullptr) continue;
            std::vector<double> theirs;
            for (std::size_t q = 0; q < kPeerQueries; ++q) {
                const auto start = Clock::now();
                if (peer->nearest(vectors.data() + q * kPeerDimension, flags_.k).empty())
                    return fail(ErrorCode::kInternal, "the peer found nothing");
                theirs.push_back(millisecondsSince(start));
            }
            peerMedians.push_back(median(theirs));
            ratios.push_back(medians.back() / peerMedians.back());
        }
        out["threads"] = flags_.threads;
        out["p50_ms"] = median(medians);
        out["p99_ms"] = percentile(all, 0.99);
        if (peer != nullptr) {
            out["peer"] = {
                {"name", vectorScanName()}, {"dimension", kPeerDimension}, {"p50_ms", median(peerMedians)}};
            out["ratio_to_faiss"] = median(ratios);
        }
        return {};
    }

    // What each bound leaves, as shares of all candidates.
    void addLadder(nlohmann::json& out) const {
        SearchCounts sum;
        for (const SearchResult& result : queries_.results) {
            sum.filtered += result.counts.filtered;
            sum.scans += result.counts.scans;
            sum.scored += result.counts.scored;
        }
        const auto share = [&](std::uint64_t left) {
            return sum.filtered == 0 ? 0.0 : static_cast<double>(left) / static_cast<double>(sum.filtered);
        };
        out["left"] = {{"first_half_of_statistics", share(sum.scans.left[kFirstHalfStage])},
                       {"statistics", share(sum.scans.left[kStatisticsStage])},
                       {"parts", share(sum.scored)}};
    }

    // All queries: in turn on one thread, and in parallel on all threads.
    Result<void> measureBatch(nlohmann::json& out) {
        std::vector<double> inside, over;
        std::vector<BatchQuery> batch;
        for (const Signature& query : queries_.signatures) batch.push_back({query, std::nullopt});
        for (std::size_t round = 0; round < kRounds; ++round) {
            Result<void> done;
            double alone = 0.0;
            double together = 0.0;
            double split = 0.0;
            withThreads(1, [&] {
                const auto start = Clock::now();
                done = searchAll(nullptr);
                alone = millisecondsSince(start);
            });
            RETURN_IF_ERROR(done);
            withThreads(flags_.threads, [&] {
                const auto start = Clock::now();
                done = searchAll(nullptr);
                split = millisecondsSince(start);
            });
            RETURN_IF_ERROR(done);
            withThreads(flags_.threads, [&] {
                const auto start = Clock::now();
                const auto results = topKBatch(batch, set_, options_, bench_.context());
                together = millisecondsSince(start);
                if (!results) done = fail(results.error());
            });
            RETURN_IF_ERROR(done);
            inside.push_back(alone / split);
            over.push_back(alone / together);
        }
        out["speedup_one_by_one"] = median(inside);
        out["speedup_batch"] = median(over);
        return {};
    }

    // Checked against signatures made anew, not read back from the set.
    Result<void> check(nlohmann::json& out) {
        const bool full = shapes_ <= kFullCheck;
        std::vector<std::uint64_t> rows(std::min(shapes_, kFullCheck));
        Random random(flags_.seed + 3);
        for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = full ? i : random.below(shapes_);
        std::vector<Signature> signatures(rows.size());
        tbb::parallel_for(std::size_t{0}, rows.size(),
                          [&](std::size_t i) { signatures[i] = generator_->make(rows[i]); });
        const std::size_t checked = std::min<std::size_t>(queries_.signatures.size(), full ? 100 : 20);
        for (std::size_t q = 0; q < checked; ++q) {
            RETURN_IF_ERROR(bench_.context().checkpoint());
            RETURN_IF_ERROR(checkQuery(q, rows, signatures, full));
        }
        out["checked"] = {{"queries", checked}, {"scores_each", rows.size()}, {"all_shapes", full}};
        return {};
    }

    Result<void> checkQuery(std::size_t q, const std::vector<std::uint64_t>& rows,
                            const std::vector<Signature>& signatures, bool full) const {
        std::vector<SearchHit> expected(rows.size());
        const auto scorer = makeScorer(queries_.signatures[q], options_.score);
        tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
            expected[i] = {static_cast<std::int64_t>(rows[i] + 1), scorer->score(signatures[i])};
        });
        const auto before = [](const SearchHit& a, const SearchHit& b) {
            return a.score != b.score ? a.score > b.score : a.id < b.id;
        };
        const auto same = [](const SearchHit& a, const SearchHit& b) {
            return a.id == b.id && a.score == b.score;
        };
        std::sort(expected.begin(), expected.end(), before);
        const std::vector<SearchHit>& hits = queries_.results[q].hits;
        bool right = true;
        if (full) {
            expected.resize(std::min(expected.size(), flags_.k));
            right = std::equal(hits.begin(), hits.end(), expected.begin(), expected.end(), same);
        } else {
            expected.erase(std::unique(expected.begin(), expected.end(), same), expected.end());
            for (const SearchHit& hit : expected) {
                if (before(hits.back(), hit)) break;
                right = right && std::any_of(hits.begin(), hits.end(),
                                             [&](const SearchHit& h) { return same(h, hit); });
            }
            for (const SearchHit& hit : hits) {
                const Signature anew = generator_->make(static_cast<std::uint64_t>(hit.id - 1));
                right = right && scorer->score(anew) == hit.score;
            }
        }
        if (right) return {};
        return fail(ErrorCode::kInternal, "query " + std::to_string(q) + " among " + std::to_string(shapes_) +
                                              " shapes is not what scoring all of them gives");
    }

    const TopkFlags& flags_;
    std::size_t shapes_;
    Mixture mixture_;
    Bench& bench_;
    std::optional<SignatureGenerator> generator_;
    SignatureSet set_;
    double buildSeconds_ = 0.0;
    SearchOptions options_;
    Queries queries_;
};

std::string line(const nlohmann::json& run) {
    const nlohmann::json& left = run["left"];
    return "| " + numberText("%.0f", run["shapes"].get<double>()) + " | " +
           numberText("%.3g", run["p50_ms"]) + " | " + numberText("%.3g", run["p99_ms"]) + " | " +
           (run.contains("peer") ? numberText("%.3g", run["peer"]["p50_ms"]) : "-") + " | " +
           (run.contains("peer") ? numberText("%.3f", run["ratio_to_faiss"]) : "-") + " | " +
           numberText("%.0f", run["bytes_per_shape"]) + " | " +
           numberText("%.3f %%", 100.0 * left["first_half_of_statistics"].get<double>()) + " | " +
           numberText("%.3f %%", 100.0 * left["statistics"].get<double>()) + " | " +
           numberText("%.4f %%", 100.0 * left["parts"].get<double>()) + " | " +
           numberText("%.2f", run["speedup_one_by_one"]) + " | " + numberText("%.2f", run["speedup_batch"]) +
           " |\n";
}

Result<std::vector<Mixture>> mixturesOf(const std::string& text) {
    const std::vector<Mixture> all = {Mixture::kPlain, Mixture::kDuplicates, Mixture::kHard};
    if (text == "all") return all;
    for (const Mixture mixture : all) {
        if (text == name(mixture)) return std::vector<Mixture>{mixture};
    }
    return fail(ErrorCode::kInvalidArgument,
                "unknown --mixture '" + text + "'; use plain, duplicates, hard or all");
}

Result<int> runTopK(const TopkFlags& flags, Bench& bench) {
    const auto mixtures = mixturesOf(flags.mixture);
    RETURN_IF_ERROR(mixtures);
    announceJson(bench.console, flags.json);
    if (vectorScanName().empty() && !flags.noPeer) {
        bench.console.note(
            "no flat scan beside it: build with -DSHAPEDB_BENCH_FAISS=ON (docs/benchmarks.md)");
    }
    const Environment here = environment();
    nlohmann::json document = {
        {"environment", environmentJson(here)}, {"command", bench.command}, {"seed", flags.seed}};
    bench.console.text(describe(here) + ", seed " + std::to_string(flags.seed) + ", k " +
                       std::to_string(flags.k) + ", " + std::to_string(flags.threads) + " threads\n");
    for (const Mixture mixture : *mixtures) {
        bench.console.text(
            std::string("\n") + name(mixture) +
            "\n| shapes | p50 ms | p99 ms | peer p50 ms | ratio | bytes each | left by the first "
            "half | by all statistics | by parts: scored | speed-up one by one | batch |\n"
            "|---|---|---|---|---|---|---|---|---|---|---|\n");
        for (const std::size_t shapes : flags.shapes) {
            auto run = TopKRun(flags, shapes, mixture, bench).run();
            RETURN_IF_ERROR(run);
            bench.console.text(line(*run));
            document["runs"].push_back(std::move(*run));
        }
    }
    RETURN_IF_ERROR(writeJson(bench.console, flags.json, document));
    return cli::kOk;
}

}  // namespace

void addTopKOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<TopkFlags>();
    CLI::App* command =
        app.add_subcommand("topk", "Exact search among many signatures, beside a flat scan of vectors");
    command->add_option("--shapes", flags->shapes, "Sizes of collections, e.g. 1000,1000000")
        ->delimiter(',')
        ->check(CLI::Range(std::size_t{100}, std::size_t{100000000}))
        ->capture_default_str();
    command->add_option("--k", flags->k, "Hits of each search")
        ->check(CLI::Range(std::size_t{1}, std::size_t{100000}))
        ->capture_default_str();
    command->add_option("--queries", flags->queries, "Searches of each round, of which there are five")
        ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}))
        ->capture_default_str();
    command->add_option("--mixture", flags->mixture, "plain, duplicates, hard or all")->capture_default_str();
    command->add_option("--threads", flags->threads, "Threads of a search")
        ->check(CLI::Range(1U, 1024U))
        ->capture_default_str();
    command->add_option("--seed", flags->seed, "Of everything drawn")->capture_default_str();
    command->add_flag("--no-peer", flags->noPeer,
                      "Leave out the flat scan (2.6 GB for 1,000,000 shapes; always above 2,000,000)");
    command->add_option("--json", flags->json, "Write the result to this file; -: to standard output");
    command->callback([flags, &bench] { bench.action = [flags, &bench] { return runTopK(*flags, bench); }; });
}

}  // namespace shapedb::bench
