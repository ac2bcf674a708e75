// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/evaluation_run.h"

#include <atomic>
#include <mutex>
#include <new>

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/return_if_error.h"
#include "core/matching/scorer.h"
#include "core/views/views.h"

namespace shapedb::cli {

namespace {

bool endsTheRun(const Error& error) {
    return error.code == ErrorCode::kCancelled || error.code == ErrorCode::kDeadlineExceeded ||
           error.code == ErrorCode::kInvalidArgument;
}

// Ids of a SignatureSet begin with 1.
std::int64_t idOf(std::size_t column) { return static_cast<std::int64_t>(column) + 1; }
std::size_t columnOf(std::int64_t id) { return static_cast<std::size_t>(id - 1); }

void addSurface(EvaluatedShape& shape, const PointCloud& points, bool withViews, const RunContext& context) {
    auto surface = makeSurfacePoints(points, context);
    if (surface) {
        if (withViews) {
            const auto views = makeViews(*surface, points, context);
            if (views) shape.views = std::make_shared<const ShapeViews>(*views);
        }
        shape.surface = std::make_shared<const SurfacePoints>(std::move(*surface));
    } else {
        shape.signature.reset();
        shape.failure = surface.error();
    }
}

}  // namespace

unsigned defaultThreads() { return static_cast<unsigned>(tbb::info::default_concurrency()); }

Result<void> forEachItem(std::size_t count, unsigned threads, const RunContext& context,
                         const std::function<std::optional<Error>(std::size_t)>& body) {
    std::mutex mutex;
    std::optional<Error> stop;
    std::atomic<bool> stopped{false};
    const auto record = [&](Error error) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!stop) stop = std::move(error);
        stopped.store(true, std::memory_order_relaxed);
    };
    try {
        // Otherwise oneTBB stops at the number of processors, with a warning on standard error.
        const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism, threads);
        tbb::task_arena arena(static_cast<int>(threads));
        arena.execute([&] {
            tbb::parallel_for(
                tbb::blocked_range<std::size_t>(0, count, 1),
                [&](const tbb::blocked_range<std::size_t>& range) {
                    for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        if (stopped.load(std::memory_order_relaxed)) return;
                        if (const auto proceed = context.checkpoint(); !proceed)
                            return record(proceed.error());
                        if (auto error = body(i)) return record(std::move(*error));
                    }
                },
                tbb::simple_partitioner());
        });
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for this many threads; try fewer");
    }
    if (stop) return fail(std::move(*stop));
    return {};
}

std::vector<EvaluatedShape> shapesOf(const std::vector<CollectionScan>& scans) {
    std::vector<EvaluatedShape> shapes(scans.size());
    for (std::size_t i = 0; i < scans.size(); ++i) static_cast<CollectionScan&>(shapes[i]) = scans[i];
    return shapes;
}

Result<void> describeShapes(std::vector<EvaluatedShape>& shapes, const ScanFlags& flags,
                            const ShapeParameters& parameters, bool withSurface, unsigned threads,
                            const std::function<void(std::size_t done)>& progress,
                            const RunContext& context) {
    RunContext quiet = context;  // progress counts shapes, not the stages of one
    quiet.progress = nullptr;
    std::atomic<std::size_t> done{0};
    return forEachItem(shapes.size(), threads, context, [&](std::size_t i) -> std::optional<Error> {
        EvaluatedShape& shape = shapes[i];
        const auto start = RunContext::Clock::now();
        const auto scan = loadScan(shape.path, flags, fileSeed(flags.seed, shape.name), quiet);
        if (!scan) {
            shape.failure = scan.error();
        } else if (auto description = describe(scan->points, parameters, quiet); !description) {
            shape.failure = description.error();
        } else {
            shape.signature = std::move(description->signature);
            if (withSurface) addSurface(shape, scan->points, parameters.views, quiet);
        }
        shape.seconds = std::chrono::duration<double>(RunContext::Clock::now() - start).count();
        if (shape.failure && endsTheRun(*shape.failure)) return shape.failure;
        progress(++done);
        return std::nullopt;
    });
}

Result<ScoreMatrix> scorePairs(const std::vector<EvaluatedShape>& rows,
                               const std::vector<EvaluatedShape>& columns, const ScoreOptions& options,
                               unsigned threads, const std::function<void(std::size_t rowsDone)>& progress,
                               const RunContext& context) {
    const bool symmetric = &rows == &columns && !options.partial;
    const std::size_t width = columns.size();
    ScoreMatrix scores(rows.size() * width, 0.0);
    std::atomic<std::size_t> done{0};
    const auto scored =
        forEachItem(rows.size(), threads, context, [&](std::size_t r) -> std::optional<Error> {
            const auto scorer = rows[r].signature ? makeScorer(*rows[r].signature, options) : nullptr;
            for (std::size_t c = symmetric ? r : 0; c < width && scorer; ++c) {
                if (!columns[c].signature) continue;
                const double value = scorer->score(*columns[c].signature);
                scores[r * width + c] = value;
                // Only this task writes (c, r): no other row reaches left of its diagonal.
                if (symmetric) scores[c * width + r] = value;
            }
            progress(++done);
            return std::nullopt;
        });
    RETURN_IF_ERROR(scored);
    return scores;
}

Result<ScoreMatrix> verifyPairs(const std::vector<EvaluatedShape>& rows,
                                const std::vector<EvaluatedShape>& columns, const ScoreOptions& options,
                                const VerifyOptions& verify, unsigned threads,
                                const std::function<void(std::size_t rowsDone)>& progress,
                                const RunContext& context) {
    const std::size_t width = columns.size();
    std::vector<IndexEntry> entries;
    for (std::size_t c = 0; c < width; ++c) {
        if (columns[c].signature) entries.push_back({idOf(c), {}, *columns[c].signature, columns[c].views});
    }
    const SignatureSet set = SignatureSet().with(entries, {});
    const SurfaceOf surfaceOf = [&](std::int64_t id) -> Result<std::shared_ptr<const SurfacePoints>> {
        return columns[columnOf(id)].surface;
    };
    RunContext quiet = context;  // progress counts queries
    quiet.progress = nullptr;
    ScoreMatrix scores(rows.size() * width, 0.0);
    std::atomic<std::size_t> done{0};
    const auto scored =
        forEachItem(rows.size(), threads, context, [&](std::size_t r) -> std::optional<Error> {
            SearchOptions search;
            search.k = std::max<std::size_t>(1, width);
            search.score = options;
            if (&rows == &columns) search.excludeId = idOf(r);
            if (rows[r].signature) {
                if (search.excludeId) scores[r * width + r] = 1.0;
                const auto found =
                    topKVerified(*rows[r].signature, *rows[r].surface, set, search, verify, surfaceOf, quiet);
                if (!found) return found.error();
                for (const VerifiedHit& hit : found->hits) {
                    scores[r * width + columnOf(hit.id)] = hit.score;
                }
            }
            progress(++done);
            return std::nullopt;
        });
    RETURN_IF_ERROR(scored);
    return scores;
}

}  // namespace shapedb::cli
