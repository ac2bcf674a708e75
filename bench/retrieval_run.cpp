// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/retrieval_run.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <utility>

#include "bench/measuring.h"
#include "client/cli/evaluation_run.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/geometry/motion.h"

namespace shapedb::bench {

namespace {

using cli::CollectionScan;

/// Lower than any negated distance; and one lower still, for ties with failures.
constexpr double kFailedScore = std::numeric_limits<double>::lowest();
constexpr double kBelowFailed = -std::numeric_limits<double>::infinity();

/// The result of one method for one scan.
struct Item {
    std::optional<Features> features;
    std::optional<ScanFailure> failure;
    double seconds = 0.0;
};

/// By method, then by scan.
using Described = std::vector<std::vector<Item>>;

bool endsTheRun(ErrorCode code) {
    return code == ErrorCode::kCancelled || code == ErrorCode::kDeadlineExceeded;
}

/// Relative to the mean, so that coordinates far from the origin lose no digits.
PointCloud turned(const PointCloud& points, Random& random) {
    const Matrix3 rotation = randomRotation(random);
    Point3 mean;
    const double share = points.empty() ? 0.0 : 1.0 / static_cast<double>(points.size());
    for (const Point3& p : points) mean = mean + share * p;
    PointCloud out;
    out.reserve(points.size());
    for (const Point3& p : points) out.push_back(rotate(rotation, p - mean));
    return out;
}

/// The error that ends the run, if any; other errors are failures of the scan.
std::optional<Error> describeOne(const CollectionScan& scan, std::size_t index,
                                 const RetrievalSettings& settings, double noise,
                                 const std::vector<Method>& methods, const RunContext& context,
                                 Described& described) {
    cli::ScanFlags flags = settings.scan;
    flags.noise = noise;
    auto loaded = cli::loadScan(scan.path, flags, cli::fileSeed(flags.seed, scan.name), context);
    if (!loaded) {
        const Error& error = loaded.error();
        if (endsTheRun(error.code) || error.code == ErrorCode::kInvalidArgument) return error;
        for (auto& items : described) items[index].failure = ScanFailure{scan.path, error, true};
        return std::nullopt;
    }
    Random random(cli::fileSeed(flags.seed, "pose of " + scan.name));
    const PointCloud points = settings.rotate ? turned(loaded->points, random) : std::move(loaded->points);
    const std::uint64_t seed = random.next();
    for (std::size_t m = 0; m < methods.size(); ++m) {
        Item& item = described[m][index];
        const ThreadStopwatch stopwatch;
        auto features = methods[m].describe(points, seed, context);
        item.seconds = stopwatch.seconds();
        if (features) {
            item.features = std::move(*features);
        } else if (endsTheRun(features.error().code)) {
            return features.error();
        } else {
            item.failure = ScanFailure{scan.path, features.error(), false};
        }
    }
    return std::nullopt;
}

Result<Described> describeAll(const std::vector<CollectionScan>& scans, const RetrievalSettings& settings,
                              double noise, const std::vector<Method>& methods, const std::string& what,
                              const Progress& progress, const RunContext& context) {
    Described described(methods.size());
    for (auto& items : described) items.resize(scans.size());
    std::atomic<std::size_t> done{0};
    const auto run =
        cli::forEachItem(scans.size(), settings.threads, context, [&](std::size_t i) -> std::optional<Error> {
            if (auto error = describeOne(scans[i], i, settings, noise, methods, context, described)) {
                return error;
            }
            progress(what, ++done, scans.size());
            return std::nullopt;
        });
    RETURN_IF_ERROR(run);
    return described;
}

struct Scored {
    ScoreMatrix scores;  ///< row-major, rows x columns
    double secondsPerPair = 0.0;
};

/// For the same vector twice each pair is scored once.
Result<Scored> scoreAll(const Method& method, const std::vector<Item>& rows, const std::vector<Item>& columns,
                        unsigned threads, const RunContext& context) {
    const bool symmetric = &rows == &columns;
    const std::size_t width = columns.size();
    Scored scored;
    scored.scores.assign(rows.size() * width, kFailedScore);
    std::vector<double> seconds(rows.size(), 0.0);
    std::vector<std::size_t> pairs(rows.size(), 0);
    const auto run =
        cli::forEachItem(rows.size(), threads, context, [&](std::size_t r) -> std::optional<Error> {
            const ThreadStopwatch stopwatch;
            for (std::size_t c = symmetric ? r + 1 : 0; c < width; ++c) {
                if (!rows[r].features || !columns[c].features) continue;
                const double value = method.score(*rows[r].features, *columns[c].features);
                ++pairs[r];
                scored.scores[r * width + c] = value;
                if (symmetric) scored.scores[c * width + r] = value;
            }
            seconds[r] = stopwatch.seconds();
            return std::nullopt;
        });
    RETURN_IF_ERROR(run);
    double total = 0.0;
    std::size_t count = 0;
    for (std::size_t r = 0; r < rows.size(); ++r) {
        total += seconds[r];
        count += pairs[r];
    }
    if (count > 0) scored.secondsPerPair = total / static_cast<double>(count);
    return scored;
}

/// Adds failures and the time per described scan.
void tell(MethodResult& result, std::initializer_list<const std::vector<Item>*> parts) {
    double seconds = 0.0;
    std::size_t described = 0;
    for (const std::vector<Item>* items : parts) {
        for (const Item& item : *items) {
            if (item.failure) {
                result.failures.push_back(*item.failure);
            } else {
                seconds += item.seconds;
                ++described;
            }
        }
    }
    if (described > 0) result.secondsPerShape = seconds / static_cast<double>(described);
}

Result<void> leaveOneOut(const RetrievalTask& task, const std::vector<Item>& items, ScoreMatrix scores,
                         MethodResult& result) {
    std::vector<std::string> labels;
    std::vector<bool> failed;
    for (std::size_t i = 0; i < items.size(); ++i) {
        labels.push_back(task.queries[i].label);
        failed.push_back(items[i].failure.has_value());
    }
    scores = cli::withTiesAgainstFailures(std::move(scores), labels, failed, kBelowFailed);
    const auto report = evaluateLeaveOneOut(scores, labels);
    RETURN_IF_ERROR(report);
    auto precision = precisionAtRecall(scores, labels);
    RETURN_IF_ERROR(precision);
    result.metrics = report->mean;
    result.precision = std::move(*precision);
    return {};
}

Result<void> againstGallery(const RetrievalTask& task, const std::vector<Item>& queries,
                            const std::vector<Item>& gallery, const ScoreMatrix& scores,
                            MethodResult& result) {
    std::vector<GalleryQuery> asked;
    for (std::size_t q = 0; q < queries.size(); ++q) {
        asked.push_back(
            cli::rankGallery(task.match, task.queries[q], task.gallery, scores.data() + q * gallery.size(),
                             [&](std::size_t g) { return queries[q].features && gallery[g].features; }));
    }
    auto report = evaluateGallery(asked, gallery.size());
    RETURN_IF_ERROR(report);
    for (std::size_t q = 0; q < queries.size(); ++q) {
        QueryResult one;
        one.query = task.queries[q].name;
        one.rank = report->firstRightRank[q];
        if (!asked[q].ranking.empty()) {
            const std::size_t best = asked[q].ranking.front();
            one.firstHit = task.gallery[best].name;
            one.score = scores[q * gallery.size() + best];
        }
        result.queries.push_back(std::move(one));
    }
    result.gallery = std::move(*report);
    return {};
}

}  // namespace

Result<std::vector<LevelResult>> runRetrieval(const RetrievalTask& task, const RetrievalSettings& settings,
                                              const std::vector<Method>& methods, const Progress& progress,
                                              const RunContext& context) {
    const bool hasGallery = !task.gallery.empty();
    Described gallery;
    if (hasGallery) {
        RetrievalSettings clean = settings;
        clean.scan.points.reset();
        auto described = describeAll(task.gallery, clean, 0.0, methods, "gallery", progress, context);
        RETURN_IF_ERROR(described);
        gallery = std::move(*described);
    }
    std::vector<LevelResult> levels;
    for (const double noise : settings.noise) {
        const std::string what =
            "level " + std::to_string(levels.size() + 1) + " of " + std::to_string(settings.noise.size());
        const auto queries = describeAll(task.queries, settings, noise, methods, what, progress, context);
        RETURN_IF_ERROR(queries);
        LevelResult level;
        level.noise = noise;
        for (std::size_t m = 0; m < methods.size(); ++m) {
            const std::vector<Item>& rows = (*queries)[m];
            const std::vector<Item>& columns = hasGallery ? gallery[m] : rows;
            auto scored = scoreAll(methods[m], rows, columns, settings.threads, context);
            RETURN_IF_ERROR(scored);
            MethodResult result;
            result.name = methods[m].name;
            result.title = methods[m].title;
            result.comparison = methods[m].comparison;
            result.secondsPerPair = scored->secondsPerPair;
            if (hasGallery) {
                tell(result, {&rows, &columns});
            } else {
                tell(result, {&rows});
            }
            const auto measured = hasGallery ? againstGallery(task, rows, columns, scored->scores, result)
                                             : leaveOneOut(task, rows, std::move(scored->scores), result);
            RETURN_IF_ERROR(measured);
            level.methods.push_back(std::move(result));
        }
        levels.push_back(std::move(level));
    }
    return levels;
}

namespace {

/// Precision at the rank of each right candidate, in the order they are found; empty without any.
std::vector<double> precisions(const ScoreMatrix& scores, const std::vector<std::string>& labels,
                               std::size_t query) {
    std::vector<double> found;
    std::size_t rank = 0;
    for (const std::size_t candidate : rankOthers(scores, labels.size(), query)) {
        ++rank;
        if (labels[candidate] != labels[query]) continue;
        found.push_back(static_cast<double>(found.size() + 1) / static_cast<double>(rank));
    }
    return found;
}

}  // namespace

Result<std::vector<double>> precisionAtRecall(const ScoreMatrix& scores,
                                              const std::vector<std::string>& labels) {
    RETURN_IF_ERROR(checkScoreMatrix(scores, labels.size()));
    std::vector<double> mean(kRecallLevels, 0.0);
    std::size_t queries = 0;
    for (std::size_t query = 0; query < labels.size(); ++query) {
        std::vector<double> best = precisions(scores, labels, query);
        if (best.empty()) continue;
        ++queries;
        for (std::size_t i = best.size() - 1; i > 0; --i) best[i - 1] = std::max(best[i - 1], best[i]);
        for (std::size_t level = 1; level <= kRecallLevels; ++level) {
            // The smallest number of right candidates that reaches the level, in integers.
            const std::size_t needed = (level * best.size() + kRecallLevels - 1) / kRecallLevels;
            mean[level - 1] += best[needed - 1];
        }
    }
    for (double& value : mean) value /= static_cast<double>(std::max<std::size_t>(queries, 1));
    return mean;
}

}  // namespace shapedb::bench
