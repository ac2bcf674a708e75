// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench verdicts`: what scores and verdicts are worth, by searches whose right answers are known.
#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/measuring.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/simulated_searches.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/search/verify.h"

namespace shapedb::bench {

namespace {

// How queries are made of shapes of the gallery. One on a table is nothing new to a verdict.
constexpr std::array<Change, 7> kJudged{Change::kRescan,   Change::kNoisy,   Change::kSparse,
                                        Change::kOneSided, Change::kPiece65, Change::kPiece50,
                                        Change::kBent};

// What a hit is to the query.
enum class Relation { kSame, kBent, kPart, kKind, kUnrelated };
constexpr std::array<const char*, 5> kRelationNames{"same object", "bent", "part of it", "same kind",
                                                    "unrelated"};

struct VerdictsFlags {
    std::vector<std::string> gallery;
    std::size_t members = 6;
    std::uint64_t seed = 1;
    std::string json;
    unsigned threads = cli::defaultThreads();
};

struct Judged {
    Change change = Change::kRescan;
    Relation relation = Relation::kSame;
    std::size_t rank = 0;
    bool present = true;  // the query's own shape is in the gallery
    double score = 0.0;
    double distance = 0.0;  // of the signatures
    Verdict verdict = Verdict::kNone;
    FitResult fit;
};

Relation relationOf(Change change, bool self, bool sameLabel) {
    if (!self) return sameLabel ? Relation::kKind : Relation::kUnrelated;
    if (change == Change::kBent) return Relation::kBent;
    return change == Change::kPiece65 || change == Change::kPiece50 ? Relation::kPart : Relation::kSame;
}

struct Study {
    std::vector<Judged> judged;
    std::size_t shapes = 0;
    std::size_t queries = 0;
    std::size_t failures = 0;
};

// Query `q` of all: every model changed in every way. Sets `hits`, empty if it cannot be described.
std::optional<Error> searchOne(std::size_t q, const std::vector<LabelledModel>& models,
                               const Gallery& gallery, const SignatureSet& set, const VerdictsFlags& flags,
                               const RunContext& context, std::optional<std::vector<Judged>>& hits) {
    const std::size_t model = q / kJudged.size();
    const Change change = kJudged[q % kJudged.size()];
    const auto cloud = makeQuery(models[model].points, change, flags.seed + 1000 * q, context);
    if (!cloud) return cloud.error();
    const auto query = describeModel(*cloud, false, context);
    if (!query) return query.error();
    if (!query->signature) return std::nullopt;
    // Every other query is of a shape that the gallery does not have.
    const bool present = (model + q % kJudged.size()) % 2 == 0;
    SearchOptions options;
    options.k = 10;
    if (!present) options.excludeId = static_cast<std::int64_t>(model) + 1;
    const SurfaceOf surfaceOf = [&](std::int64_t id) -> Result<std::shared_ptr<const SurfacePoints>> {
        return gallery.shapes[static_cast<std::size_t>(id) - 1].surface;
    };
    const auto found = topKVerified(*query->signature, *query->surface, set, options, {}, surfaceOf, context);
    if (!found) return found.error();
    hits.emplace();
    for (std::size_t rank = 0; rank < found->hits.size(); ++rank) {
        const VerifiedHit& hit = found->hits[rank];
        if (!hit.fit) continue;
        const auto other = static_cast<std::size_t>(hit.id) - 1;
        const Relation relation =
            relationOf(change, other == model, models[other].label == models[model].label);
        hits->push_back({change, relation, rank, present, hit.score, distanceOfScore(hit.signatureScore),
                         hit.verdict, *hit.fit});
    }
    return std::nullopt;
}

Result<Study> study(const VerdictsFlags& flags, Bench& bench) {
    const RunContext context = bench.context();
    const auto models = labelledModels(flags.gallery, flags.members, flags.seed, context);
    RETURN_IF_ERROR(models);
    const auto gallery = describeGallery(*models, flags.threads, context);
    RETURN_IF_ERROR(gallery);
    const SignatureSet set = SignatureSet().with(gallery->entries, {});
    std::vector<std::optional<std::vector<Judged>>> found(models->size() * kJudged.size());
    std::atomic<std::size_t> done{0};
    RETURN_IF_ERROR(cli::forEachItem(found.size(), flags.threads, context, [&](std::size_t q) {
        auto error = searchOne(q, *models, *gallery, set, flags, context, found[q]);
        bench.console.progress("searches", ++done, found.size());
        return error;
    }));
    Study result;
    result.shapes = models->size();
    for (const auto& hits : found) {
        ++(hits ? result.queries : result.failures);
        if (hits) result.judged.insert(result.judged.end(), hits->begin(), hits->end());
    }
    return result;
}

nlohmann::json rowsOf(const Study& study) {
    nlohmann::json rows = nlohmann::json::array();
    for (const Judged& one : study.judged) {
        rows.push_back({{"change", infoOf(one.change).description},
                        {"relation", kRelationNames[static_cast<std::size_t>(one.relation)]},
                        {"rank", one.rank},
                        {"present", one.present},
                        {"score", one.score},
                        {"distance", one.distance},
                        {"misfit", one.fit.misfit},
                        {"kind", static_cast<int>(one.fit.kind)},
                        {"F", one.fit.best.score},
                        {"query", one.fit.best.explainedQuery},
                        {"other", one.fit.best.explainedOther},
                        {"residual", one.fit.best.residual}});
    }
    return rows;
}

// Whether a verdict is true. Scans of one side, sparse and noisy ones are of the same object.
bool isTrue(Verdict verdict, Relation relation) {
    switch (verdict) {
        case Verdict::kNone: return false;
        case Verdict::kSameObject: return relation == Relation::kSame;
        case Verdict::kSameObjectBent: return relation == Relation::kBent;
        case Verdict::kPart: return relation == Relation::kPart;
        case Verdict::kSameKind: return relation == Relation::kKind;
        case Verdict::kUnrelated: return relation == Relation::kUnrelated;
    }
    return false;
}

std::string scoreTable(const Study& study) {
    std::string text =
        "| query | hits | 5 % below | median | 95 % below | 0.9 or more |\n|---|---:|---:|---:|---:|---:|\n";
    for (const Change change : kJudged) {
        for (std::size_t relation = 0; relation < kRelationNames.size(); ++relation) {
            std::vector<double> scores;
            for (const Judged& one : study.judged) {
                if (one.change == change && one.relation == static_cast<Relation>(relation)) {
                    scores.push_back(one.score);
                }
            }
            if (scores.empty()) continue;
            const auto high = std::count_if(scores.begin(), scores.end(), [](double s) { return s >= 0.9; });
            text += std::string("| ") + infoOf(change).description + ": " + kRelationNames[relation] + " | " +
                    std::to_string(scores.size()) + " | " + numberText("%.2f", percentile(scores, 0.05)) +
                    " | " + numberText("%.2f", median(scores)) + " | " +
                    numberText("%.2f", percentile(scores, 0.95)) + " | " +
                    numberText("%.3f", static_cast<double>(high) / static_cast<double>(scores.size())) +
                    " |\n";
        }
    }
    return text;
}

// What a hit with such a score is: shares of all ten hits of all queries. The changed query's own shape
// counts as the same object, however it was changed.
std::string meaningTable(const Study& study) {
    constexpr std::array<double, 7> kFrom{0.9, 0.8, 0.7, 0.6, 0.5, 0.3, 0.0};
    std::string text = "| score | hits | same object | same kind | unrelated |\n|---|---:|---:|---:|---:|\n";
    double to = 1.0;
    for (const double from : kFrom) {
        std::size_t same = 0;
        std::size_t kind = 0;
        std::size_t hits = 0;
        for (const Judged& one : study.judged) {
            if (one.score < from || (one.score >= to && to < 1.0)) continue;
            ++hits;
            kind += one.relation == Relation::kKind ? 1 : 0;
            same += one.relation != Relation::kKind && one.relation != Relation::kUnrelated ? 1 : 0;
        }
        const auto share = [&](std::size_t count) {
            return numberText("%.2f",
                              hits > 0 ? static_cast<double>(count) / static_cast<double>(hits) : 0.0);
        };
        text += "| " + numberText("%.1f", from) + " to " + numberText("%.1f", to) + " | " +
                std::to_string(hits) + " | " + share(same) + " | " + share(kind) + " | " +
                share(hits - same - kind) + " |\n";
        to = from;
    }
    return text;
}

std::string verdictTable(const Study& study) {
    std::string text =
        "| verdict | hits | right | says | is the same object | bent | part | same kind | unrelated |\n"
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for (const Verdict verdict : {Verdict::kSameObject, Verdict::kSameObjectBent, Verdict::kPart,
                                  Verdict::kSameKind, Verdict::kUnrelated}) {
        std::array<std::size_t, 5> relations{};
        std::size_t hits = 0;
        std::size_t right = 0;
        for (const Judged& one : study.judged) {
            if (one.verdict != verdict) continue;
            ++hits;
            ++relations[static_cast<std::size_t>(one.relation)];
            right += isTrue(verdict, one.relation) ? 1 : 0;
        }
        text += std::string("| ") + verdictName(verdict) + " | " + std::to_string(hits) + " | " +
                numberText("%.2f", hits > 0 ? static_cast<double>(right) / static_cast<double>(hits) : 0.0) +
                " | " + numberText("%.2f", reliabilityOf(verdict)) + " |";
        for (const std::size_t count : relations) text += " " + std::to_string(count) + " |";
        text += "\n";
    }
    return text;
}

// Of the queries whose own shape is in the gallery.
std::string firstTable(const Study& study) {
    std::string text = "| query | its own shape first | among the first ten |\n|---|---:|---:|\n";
    for (const Change change : kJudged) {
        std::size_t first = 0;
        std::size_t listed = 0;
        std::size_t queries = 0;
        for (const Judged& one : study.judged) {
            if (one.change != change || !one.present) continue;
            queries += one.rank == 0 ? 1 : 0;
            const bool own = one.relation == relationOf(one.change, true, true);
            listed += own ? 1 : 0;
            first += own && one.rank == 0 ? 1 : 0;
        }
        const double all = std::max<double>(1.0, static_cast<double>(queries));
        text += std::string("| ") + infoOf(change).description + " (" + std::to_string(queries) + ") | " +
                numberText("%.3f", static_cast<double>(first) / all) + " | " +
                numberText("%.3f", static_cast<double>(listed) / all) + " |\n";
    }
    return text;
}

std::string report(const Study& study, const VerdictsFlags& flags) {
    return describe(environment()) + "\n\n" + std::to_string(study.queries) + " searches in a gallery of " +
           std::to_string(study.shapes) + " shapes, half of them without the query's own shape, seed " +
           std::to_string(flags.seed) + "; the ten best hits of each; " + std::to_string(study.failures) +
           " queries could not be described.\n\n" + firstTable(study) + "\n" + scoreTable(study) + "\n" +
           meaningTable(study) + "\n" + verdictTable(study);
}

Result<int> run(const VerdictsFlags& flags, Bench& bench) {
    announceJson(bench.console, flags.json);
    const auto result = study(flags, bench);
    RETURN_IF_ERROR(result);
    bench.console.text(report(*result, flags));
    RETURN_IF_ERROR(writeJson(bench.console, flags.json, rowsOf(*result)));
    return cli::kOk;
}

}  // namespace

void addVerdictsOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<VerdictsFlags>();
    CLI::App* command = app.add_subcommand(
        "verdicts", "Measures what scores and verdicts are worth, by searches whose right answers are known");
    command->add_option("GALLERY", flags->gallery, "Folders of class folders; without, synthetic families");
    command->add_option("--count", flags->members, "Shapes of each synthetic family")->capture_default_str();
    command->add_option("--seed", flags->seed, "Seed for everything")->capture_default_str();
    command->add_option("--threads", flags->threads, "Number of threads")->capture_default_str();
    command->add_option("--json", flags->json, "Write every hit to this file, or - for standard output");
    command->callback([flags, &bench] { bench.action = [flags, &bench] { return run(*flags, bench); }; });
}

}  // namespace shapedb::bench
