// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench views`: is the right shape among the first of a search with a scan of one side?
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/measuring.h"
#include "bench/models.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "client/cli/retrieval_task.h"
#include "client/io/scan_reader.h"
#include "core/base/return_if_error.h"
#include "core/fit/surface_points.h"
#include "core/matching/scorer.h"
#include "core/pipeline.h"
#include "core/synthetic/degrade.h"
#include "core/views/view_distance.h"
#include "core/views/views.h"

namespace shapedb::bench {

namespace {

constexpr std::size_t kPointsOfQuery = 20000;
constexpr std::size_t kLeastToHalve = 8000;
// Of unrelated shapes, to add the two distances.
constexpr double kTypicalViewDistance = 150.0;

struct ViewsFlags {
    std::vector<std::string> gallery;
    std::vector<std::string> queries;
    std::size_t synthetic = 0;
    std::size_t perShape = 1;
    OneSidedSettings scan;
    std::uint64_t seed = 1;
    bool noProfile = false;
    bool surfaceOnly = false;
    bool list = false;
    unsigned threads = cli::defaultThreads();
    ViewOptions views;
};

struct Model {
    std::string name;
    std::string stem;
    PointCloud points;
};

// What each way of comparing keeps of a shape of the gallery or of a query.
struct DescribedViews {
    std::string name;
    std::vector<std::size_t> right;  // of a query
    std::optional<ViewSet> set;
    std::optional<ViewSignature> view;
    std::optional<Signature> signature;
    double seconds = 0.0;  // for views, without surface points
};

bool stops(const Error& error) {
    return error.code == ErrorCode::kCancelled || error.code == ErrorCode::kDeadlineExceeded;
}

Result<std::vector<Model>> readModels(const std::vector<std::string>& folders, const RunContext& context) {
    std::vector<Model> models;
    if (folders.empty()) return models;
    const auto scans = cli::listCollection(folders);
    RETURN_IF_ERROR(scans);
    for (const auto& scan : *scans) {
        const auto read = readScan(scan.path, {}, context);
        RETURN_IF_ERROR(read);
        models.push_back({scan.label + "/" + scan.name, std::filesystem::path(scan.path).stem().string(),
                          subsample(read->points, 2 * kPointsOfQuery, 1)});
    }
    return models;
}

Result<void> addFamilies(std::vector<Model>& models, std::size_t members, std::uint64_t seed) {
    auto scans = scansOfFamilies(members, kPointsOfQuery, seed);
    RETURN_IF_ERROR(scans);
    for (FamilyScan& scan : *scans) {
        const std::string name = scan.family + std::to_string(scan.member);
        models.push_back({name, name, std::move(scan.points)});
    }
    return {};
}

// So that gallery and query share no point, if there are enough.
PointCloud half(const PointCloud& points, std::size_t which) {
    return points.size() < kLeastToHalve ? points : halfOf(points, which);
}

std::optional<Error> describeShape(const PointCloud& points, const ViewsFlags& flags, bool whole,
                                   DescribedViews& shape, const RunContext& context) {
    const auto surface = makeSurfacePoints(points, context);
    if (!surface && stops(surface.error())) return surface.error();
    if (surface) {
        const ThreadStopwatch watch;
        if (whole) {
            auto set = makeViews(*surface, flags.surfaceOnly ? PointCloud{} : points, context);
            if (!set) return set.error();
            shape.set = *set;
        } else {
            auto view = makeViewOfScan(*surface);
            if (!view) return view.error();
            shape.view = *view;
        }
        shape.seconds = watch.seconds();
    }
    if (flags.noProfile) return std::nullopt;
    auto described = describe(points, parametersOf(Profile::kDefault), context);
    if (!described && stops(described.error())) return described.error();
    if (described) shape.signature = std::move(described->signature);
    return std::nullopt;
}

// Gallery indices by rising distance, equal ones with the right answers last.
std::vector<std::size_t> orderBy(const std::vector<double>& distance, const std::vector<bool>& right) {
    std::vector<std::size_t> order(distance.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return distance[a] != distance[b] ? distance[a] < distance[b] : right[a] < right[b];
    });
    return order;
}

std::size_t rankOf(const std::vector<std::size_t>& order, const std::vector<bool>& right) {
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (right[order[i]]) return i + 1;
    }
    return order.size();
}

// Takes from both in turn.
std::vector<std::size_t> interleaved(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
    std::vector<std::size_t> order;
    std::vector<bool> taken(a.size(), false);
    for (std::size_t i = 0; i < a.size(); ++i) {
        for (const std::size_t g : {a[i], b[i]}) {
            if (!taken[g]) order.push_back(g);
            taken[g] = true;
        }
    }
    return order;
}

struct Ranks {
    std::size_t views = 0;
    std::size_t profile = 0;
    std::size_t interleaved = 0;
    std::size_t sum = 0;
};

Ranks ranksOf(const DescribedViews& query, const std::vector<DescribedViews>& gallery,
              const ViewsFlags& flags, std::vector<double>* unrelated) {
    std::vector<bool> right(gallery.size(), false);
    for (const std::size_t g : query.right) right[g] = true;
    std::vector<double> byView(gallery.size(), INFINITY);
    std::vector<double> byProfile(gallery.size(), INFINITY);
    std::vector<double> sum(gallery.size(), INFINITY);
    const auto scorer = query.signature ? makeScorer(*query.signature, {}) : nullptr;
    std::optional<ViewQuery> view;
    if (query.view) view.emplace(*query.view, flags.views);
    for (std::size_t g = 0; g < gallery.size(); ++g) {
        if (view && gallery[g].set) byView[g] = view->distance(*gallery[g].set);
        if (scorer && gallery[g].signature) {
            const double score = scorer->score(*gallery[g].signature);
            byProfile[g] = 0.5 * std::sqrt(std::max(0.0, 1.0 / std::max(score, 1e-9) - 1.0));
        }
        sum[g] = byProfile[g] + byView[g] / kTypicalViewDistance;
        if (!right[g]) unrelated->push_back(byView[g]);
    }
    const auto views = orderBy(byView, right);
    const auto profile = orderBy(byProfile, right);
    return {rankOf(views, right), rankOf(profile, right), rankOf(interleaved(views, profile), right),
            rankOf(orderBy(sum, right), right)};
}

std::string line(const char* name, const std::vector<std::size_t>& ranks) {
    const double n = static_cast<double>(std::max<std::size_t>(1, ranks.size()));
    double reciprocal = 0.0;
    for (const std::size_t rank : ranks) reciprocal += 1.0 / static_cast<double>(rank);
    const auto within = [&](std::size_t most) {
        return " | " + numberText("%.3f", static_cast<double>(
                                              std::count_if(ranks.begin(), ranks.end(),
                                                            [&](std::size_t rank) { return rank <= most; })) /
                                              n);
    };
    return std::string("| ") + name + " | " + numberText("%.3f", reciprocal / n) + within(1) + within(16) +
           within(32) + within(64) + " |\n";
}

Result<std::vector<DescribedViews>> describeGallery(const std::vector<Model>& models, const ViewsFlags& flags,
                                                    bool halved, const RunContext& context) {
    std::vector<DescribedViews> gallery(models.size());
    const auto run = cli::forEachItem(models.size(), flags.threads, context, [&](std::size_t i) {
        gallery[i].name = models[i].name;
        const PointCloud points = halved ? half(models[i].points, 0) : models[i].points;
        return describeShape(points, flags, true, gallery[i], context);
    });
    RETURN_IF_ERROR(run);
    return gallery;
}

Result<std::vector<DescribedViews>> simulatedQueries(const std::vector<Model>& models,
                                                     const ViewsFlags& flags, const RunContext& context) {
    std::vector<DescribedViews> queries(models.size() * flags.perShape);
    const auto run =
        cli::forEachItem(queries.size(), flags.threads, context, [&](std::size_t q) -> std::optional<Error> {
            const std::size_t m = q / flags.perShape;
            queries[q].name = models[m].name + " " + std::to_string(q % flags.perShape);
            queries[q].right = {m};
            const auto scan = oneSidedScan(half(models[m].points, 1), flags.scan,
                                           cli::fileSeed(flags.seed, queries[q].name), context);
            if (!scan) return scan.error();
            return describeShape(*scan, flags, false, queries[q], context);
        });
    RETURN_IF_ERROR(run);
    return queries;
}

Result<std::vector<DescribedViews>> readQueries(const std::vector<Model>& gallery, const ViewsFlags& flags,
                                                const RunContext& context) {
    const auto models = readModels(flags.queries, context);
    RETURN_IF_ERROR(models);
    std::vector<DescribedViews> queries;
    std::vector<const PointCloud*> points;
    for (const Model& model : *models) {
        DescribedViews query;
        query.name = model.name;
        for (std::size_t g = 0; g < gallery.size(); ++g) {
            if (gallery[g].stem == model.stem) query.right.push_back(g);
        }
        if (query.right.empty()) continue;
        queries.push_back(std::move(query));
        points.push_back(&model.points);
    }
    const auto run = cli::forEachItem(queries.size(), flags.threads, context, [&](std::size_t q) {
        return describeShape(*points[q], flags, false, queries[q], context);
    });
    RETURN_IF_ERROR(run);
    return queries;
}

std::string qualityText(const char* of, const std::vector<DescribedViews>& shapes) {
    std::vector<double> qualities;
    for (const DescribedViews& shape : shapes) {
        if (!shape.signature || !shape.signature->attributes) continue;
        qualities.push_back(shape.signature->attributes->quality / 255.0);
    }
    if (qualities.empty()) return {};
    std::sort(qualities.begin(), qualities.end());
    const auto at = [&](double share) {
        return numberText(
            "%.2f", qualities[static_cast<std::size_t>(share * static_cast<double>(qualities.size() - 1))]);
    };
    return std::string("Quality of ") + of + ", 5, 25, 50, 75, 95 %: " + at(0.05) + ", " + at(0.25) + ", " +
           at(0.5) + ", " + at(0.75) + ", " + at(0.95) + ".\n";
}

Result<int> runViews(const ViewsFlags& flags, Bench& bench) {
    auto models = readModels(flags.gallery, bench.context());
    RETURN_IF_ERROR(models);
    RETURN_IF_ERROR(addFamilies(*models, flags.synthetic, flags.seed));
    if (models->empty()) return fail(ErrorCode::kInvalidArgument, "name a folder or --synthetic");
    const auto gallery = describeGallery(*models, flags, flags.queries.empty(), bench.context());
    RETURN_IF_ERROR(gallery);
    bench.console.note("gallery described");
    const auto queries = flags.queries.empty() ? simulatedQueries(*models, flags, bench.context())
                                               : readQueries(*models, flags, bench.context());
    RETURN_IF_ERROR(queries);
    bench.console.note("queries described");
    std::vector<std::size_t> views;
    std::vector<std::size_t> profile;
    std::vector<std::size_t> both;
    std::vector<std::size_t> sum;
    std::vector<double> unrelated;
    std::string listed;
    for (const DescribedViews& query : *queries) {
        const Ranks ranks = ranksOf(query, *gallery, flags, &unrelated);
        views.push_back(ranks.views);
        profile.push_back(ranks.profile);
        both.push_back(ranks.interleaved);
        sum.push_back(ranks.sum);
        if (flags.list) {
            listed += query.name + ": views " + std::to_string(ranks.views) + ", profile " +
                      std::to_string(ranks.profile) + ", in turn " + std::to_string(ranks.interleaved) +
                      ", sum " + std::to_string(ranks.sum) + "\n";
        }
    }
    double seconds = 0.0;
    for (const DescribedViews& shape : *gallery) seconds += shape.seconds;
    std::string text = describe(environment()) + "\n\n" + std::to_string(queries->size()) + " queries, " +
                       std::to_string(gallery->size()) + " shapes; " +
                       numberText("%.1f", 1e3 * seconds / static_cast<double>(gallery->size())) +
                       " ms for the views of a shape; views of unrelated shapes have a median distance of " +
                       numberText("%.0f", median(unrelated)) +
                       ".\n\n| by | mrr | first | <= 16 | <= 32 | <= 64 |\n|---|---|---|---|---|---|\n" +
                       line("views", views);
    if (!flags.noProfile) {
        text += line("default profile", profile) + line("both in turn, views first", both) +
                line("sum of both distances", sum) + "\n" + qualityText("wholes", *gallery) +
                qualityText("queries", *queries);
    }
    bench.console.text(text + listed);
    return cli::kOk;
}

}  // namespace

void addViewsOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<ViewsFlags>();
    CLI::App* command = app.add_subcommand(
        "views", "Are the shapes found of which scans show one side, by views and by profile?");
    command->add_option("gallery", flags->gallery, "Folders with whole scans");
    command->add_option("--queries", flags->queries,
                        "Folders with scans of one side, named like what they show; else they are simulated");
    command->add_option("--synthetic", flags->synthetic, "Members of each synthetic family in the gallery");
    command->add_option("--per-shape", flags->perShape, "Simulated scans of each shape")
        ->capture_default_str();
    command->add_option("--noise", flags->scan.noise, "Standard deviation as a share of the diagonal")
        ->capture_default_str();
    command->add_option("--grazing", flags->scan.grazing, "Cosine about which grazing surface is lost")
        ->capture_default_str();
    command->add_option("--seed", flags->seed, "Of all random numbers")->capture_default_str();
    command->add_option("--threads", flags->threads, "Threads")->capture_default_str();
    command->add_flag("--no-profile", flags->noProfile, "Views alone");
    command->add_flag("--surface-only", flags->surfaceOnly, "Views from stored surface points");
    command->add_flag("--keep-scale", flags->views.keepScale, "Sizes count among views");
    command->add_flag("--list", flags->list, "Lists the ranks of each query");
    command->callback(
        [flags, &bench] { bench.action = [flags, &bench] { return runViews(*flags, bench); }; });
}

}  // namespace shapedb::bench
