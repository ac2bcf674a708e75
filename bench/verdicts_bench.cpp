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

#include "bench/environment.h"
#include "bench/models.h"
#include "bench/one_sided.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/quantiles.h"
#include "client/cli/evaluation_run.h"
#include "client/cli/exit_code.h"
#include "client/cli/retrieval_task.h"
#include "client/io/scan_reader.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/fit/surface_points.h"
#include "core/geometry/motion.h"
#include "core/matching/score_scale.h"
#include "core/pipeline.h"
#include "core/search/verify.h"
#include "core/synthetic/bend.h"
#include "core/synthetic/noise.h"
#include "core/synthetic/partial.h"
#include "core/views/views.h"

namespace shapedb::bench {

namespace {

// How a query is made of a shape of the gallery.
enum class Change { kRescan, kNoisy, kSparse, kOneSided, kPiece65, kPiece50, kBent };
constexpr std::array<Change, 7> kChanges{Change::kRescan,   Change::kNoisy,   Change::kSparse,
                                         Change::kOneSided, Change::kPiece65, Change::kPiece50,
                                         Change::kBent};
constexpr std::array<const char*, 7> kChangeNames{"60 % of the points, 0.3 % noise",
                                                  "1 % noise",
                                                  "3,000 points, 0.3 % noise",
                                                  "seen from one side",
                                                  "65 % left",
                                                  "50 % left",
                                                  "bent by 20 to 70 degrees"};

// What a hit is to the query.
enum class Relation { kSame, kBent, kPart, kKind, kUnrelated };
constexpr std::array<const char*, 5> kRelationNames{"same object", "bent", "part of it", "same kind",
                                                    "unrelated"};

// Half of them are the gallery's, the others the query's.
constexpr std::size_t kPointsOfMember = 32000;

struct VerdictsFlags {
    std::vector<std::string> gallery;
    std::size_t members = 6;
    std::uint64_t seed = 1;
    std::string json;
    unsigned threads = cli::defaultThreads();
};

struct LabelledModel {
    std::string label;
    PointCloud points;
};

struct DescribedModel {
    std::optional<Signature> signature;
    std::shared_ptr<const SurfacePoints> surface;
    std::shared_ptr<const ShapeViews> views;  // of the gallery
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

Result<std::vector<LabelledModel>> modelsOf(const VerdictsFlags& flags, const RunContext& context) {
    std::vector<LabelledModel> models;
    if (flags.gallery.empty()) {
        auto members = scansOfFamilies(flags.members, kPointsOfMember, flags.seed);
        RETURN_IF_ERROR(members);
        for (FamilyScan& one : *members) models.push_back({one.family, std::move(one.points)});
        return models;
    }
    const auto scans = cli::listCollection(flags.gallery);
    RETURN_IF_ERROR(scans);
    for (const auto& scan : *scans) {
        auto read = readScan(scan.path, {}, context);
        RETURN_IF_ERROR(read);
        models.push_back({scan.label, std::move(read->points)});
    }
    return models;
}

Result<PointCloud> queryOf(const PointCloud& points, Change change, std::uint64_t seed,
                           const RunContext& context) {
    Random random(seed);
    PointCloud cloud = halfOf(points, 1);
    double noise = 0.003;
    switch (change) {
        case Change::kRescan: cloud = subsample(cloud, cloud.size() * 6 / 10, seed); break;
        case Change::kNoisy: noise = 0.01; break;
        case Change::kSparse: cloud = subsample(cloud, 3000, seed); break;
        case Change::kOneSided: {
            auto scan = oneSidedScan(cloud, {}, seed, context);
            RETURN_IF_ERROR(scan);
            cloud = std::move(*scan);
            noise = 0.0;  // it has its own
            break;
        }
        case Change::kPiece65: cloud = cutBelow(cloud, randomDirection(random), 0.65); break;
        case Change::kPiece50: cloud = cutBelow(cloud, randomDirection(random), 0.5); break;
        case Change::kBent: cloud = bent(cloud, random.uniform(0.35, 1.22)); break;
    }
    if (noise > 0.0) RETURN_IF_ERROR(addGaussianNoise(cloud, noise, random.next()));
    Motion motion;
    motion.rotation = randomRotation(random);
    return applyToCloud(motion, cloud);
}

std::optional<Error> describeOne(const PointCloud& points, bool withViews, DescribedModel& into,
                                 const RunContext& context) {
    auto description = describe(points, parametersOf(Profile::kDefault), context);
    if (!description) return std::nullopt;
    auto surface = makeSurfacePoints(points, context);
    if (!surface) return surface.error();
    if (withViews) {
        const auto views = makeViews(*surface, points, context);
        if (!views) return views.error();
        into.views = std::make_shared<const ShapeViews>(*views);
    }
    into.signature = std::move(description->signature);
    into.surface = std::make_shared<const SurfacePoints>(std::move(*surface));
    return std::nullopt;
}

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

// The gallery, in the order of the models; ids begin with 1.
struct Gallery {
    std::vector<DescribedModel> shapes;
    SignatureSet set;
};

Result<Gallery> galleryOf(const std::vector<LabelledModel>& models, const VerdictsFlags& flags,
                          const RunContext& context) {
    Gallery gallery;
    gallery.shapes.resize(models.size());
    RETURN_IF_ERROR(cli::forEachItem(models.size(), flags.threads, context, [&](std::size_t i) {
        return describeOne(halfOf(models[i].points, 0), true, gallery.shapes[i], context);
    }));
    std::vector<IndexEntry> entries;
    for (std::size_t i = 0; i < models.size(); ++i) {
        const DescribedModel& shape = gallery.shapes[i];
        if (!shape.signature) continue;
        entries.push_back({static_cast<std::int64_t>(i) + 1, {}, *shape.signature, shape.views});
    }
    gallery.set = SignatureSet().with(entries, {});
    return gallery;
}

// Query `q` of all: every model changed in every way. Sets `hits`, empty if it cannot be described.
std::optional<Error> searchOne(std::size_t q, const std::vector<LabelledModel>& models,
                               const Gallery& gallery, const VerdictsFlags& flags, const RunContext& context,
                               std::optional<std::vector<Judged>>& hits) {
    const std::size_t model = q / kChanges.size();
    const Change change = kChanges[q % kChanges.size()];
    const auto cloud = queryOf(models[model].points, change, flags.seed + 1000 * q, context);
    if (!cloud) return cloud.error();
    DescribedModel query;
    if (auto error = describeOne(*cloud, false, query, context)) return error;
    if (!query.signature) return std::nullopt;
    // Every other query is of a shape that the gallery does not have.
    const bool present = (model + q % kChanges.size()) % 2 == 0;
    SearchOptions options;
    options.k = 10;
    if (!present) options.excludeId = static_cast<std::int64_t>(model) + 1;
    const SurfaceOf surfaceOf = [&](std::int64_t id) -> Result<std::shared_ptr<const SurfacePoints>> {
        return gallery.shapes[static_cast<std::size_t>(id) - 1].surface;
    };
    const auto found =
        topKVerified(*query.signature, *query.surface, gallery.set, options, {}, surfaceOf, context);
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
    const auto models = modelsOf(flags, context);
    RETURN_IF_ERROR(models);
    const auto gallery = galleryOf(*models, flags, context);
    RETURN_IF_ERROR(gallery);
    std::vector<std::optional<std::vector<Judged>>> found(models->size() * kChanges.size());
    std::atomic<std::size_t> done{0};
    RETURN_IF_ERROR(cli::forEachItem(found.size(), flags.threads, context, [&](std::size_t q) {
        auto error = searchOne(q, *models, *gallery, flags, context, found[q]);
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
        rows.push_back({{"change", kChangeNames[static_cast<std::size_t>(one.change)]},
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
    for (std::size_t change = 0; change < kChanges.size(); ++change) {
        for (std::size_t relation = 0; relation < kRelationNames.size(); ++relation) {
            std::vector<double> scores;
            for (const Judged& one : study.judged) {
                if (one.change == kChanges[change] && one.relation == static_cast<Relation>(relation)) {
                    scores.push_back(one.score);
                }
            }
            if (scores.empty()) continue;
            const auto high = std::count_if(scores.begin(), scores.end(), [](double s) { return s >= 0.9; });
            text += std::string("| ") + kChangeNames[change] + ": " + kRelationNames[relation] + " | " +
                    std::to_string(scores.size()) + " | " + numberText("%.2f", percentile(scores, 0.05)) +
                    " | " + numberText("%.2f", median(scores)) + " | " +
                    numberText("%.2f", percentile(scores, 0.95)) + " | " +
                    numberText("%.3f", static_cast<double>(high) / static_cast<double>(scores.size())) +
                    " |\n";
        }
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
    for (std::size_t change = 0; change < kChanges.size(); ++change) {
        std::size_t first = 0;
        std::size_t listed = 0;
        std::size_t queries = 0;
        for (const Judged& one : study.judged) {
            if (one.change != kChanges[change] || !one.present) continue;
            queries += one.rank == 0 ? 1 : 0;
            const bool own = one.relation == relationOf(one.change, true, true);
            listed += own ? 1 : 0;
            first += own && one.rank == 0 ? 1 : 0;
        }
        const double all = std::max<double>(1.0, static_cast<double>(queries));
        text += std::string("| ") + kChangeNames[change] + " (" + std::to_string(queries) + ") | " +
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
           verdictTable(study);
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
