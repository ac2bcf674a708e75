// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/signature_pipeline.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <thread>

#include "core/base/return_if_error.h"
#include "core/fit/surface_points.h"
#include "core/fit/surface_points_codec.h"
#include "core/signature/signature_codec.h"
#include "core/views/views.h"
#include "core/views/views_codec.h"
#include "server/ingest/background_thread.h"

namespace shapedb::ingest {

namespace {

using Kind = PipelineOutcome::Kind;

PipelineOutcome failed(Kind kind, Error why) {
    PipelineOutcome outcome;
    outcome.kind = kind;
    outcome.why = std::move(why);
    return outcome;
}

/// Errors: those of the context, noticed within 20 ms.
Result<void> waitFor(std::chrono::milliseconds time, const RunContext& context) {
    const auto until = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < until) {
        RETURN_IF_ERROR(context.checkpoint());
        std::this_thread::sleep_for(std::min(time, std::chrono::milliseconds(20)));
    }
    return context.checkpoint();
}

PipelineOutcome runOrThrow(const Describe& describe, store::Store& store, std::int64_t shapeId,
                           const ShapeParameters& parameters, const RunContext& context) {
    PointCloud cloud;
    Point3 origin;
    {
        // The packed points are half as large as the cloud: not kept beside it.
        const auto points = store.loadPoints(shapeId);
        if (!points) {
            return failed(isTransient(points.error().code) ? Kind::kStoreFailed : Kind::kScanFailed,
                          points.error());
        }
        context.report("start", 0, 0);
        cloud = store::toCloud(points->xyz);
        origin = points->origin;
    }
    Result<Description> description = fail(ErrorCode::kInternal, "not described");
    Result<SurfacePoints> surface = fail(ErrorCode::kInternal, "no surface points");
    Result<ViewSet> views = fail(ErrorCode::kInternal, "no views");
    onThisThreadAlone([&] {
        description = describe(cloud, parameters, context);
        if (description) surface = makeSurfacePoints(cloud, context);
        if (surface && parameters.views) views = makeViews(*surface, cloud, context);
    });
    const auto isCancelled = [](const auto& result) {
        return !result && result.error().code == ErrorCode::kCancelled;
    };
    if (isCancelled(description)) return failed(Kind::kCancelled, description.error());
    if (isCancelled(surface)) return failed(Kind::kCancelled, surface.error());
    if (isCancelled(views)) return failed(Kind::kCancelled, views.error());
    if (!description) return failed(Kind::kScanFailed, description.error());
    // Last: near 0, 0, 0 all digits of what was computed are those of the shape.
    moveBy(origin, description->signature);
    if (surface) moveBy(origin, *surface);
    PipelineOutcome outcome;
    outcome.signature = encodeSignature(description->signature);
    // A scan that has a signature but no surface points is searched all the same.
    if (surface) outcome.surface = encodeSurfacePoints(*surface);
    if (views) outcome.views = encodeViews(*views);
    outcome.seconds = description->segmentation.totalSeconds;
    return outcome;
}

}  // namespace

Result<Description> SignaturePipeline::describe(const std::vector<float>& points, const Point3& origin,
                                                const ShapeParameters& parameters,
                                                const RunContext& context) const {
    auto description = describe_(store::toCloud(points), parameters, context);
    if (description) moveBy(origin, description->signature);
    return description;
}

PipelineOutcome SignaturePipeline::run(store::Store& store, std::int64_t shapeId,
                                       const ShapeParameters& parameters, const RunContext& context) const {
    const auto attempt = [&] {
        try {
            return runOrThrow(describe_, store, shapeId, parameters, context);
        } catch (...) {
            return failed(Kind::kScanFailed, errorOfException());
        }
    };
    PipelineOutcome outcome = attempt();
    // Others may have had the memory: a scan fails only if there is none for it a while later either.
    for (const auto pause : pausesWithoutMemory_) {
        if (outcome.kind != Kind::kScanFailed || outcome.why.code != ErrorCode::kOutOfMemory) break;
        if (const auto waited = waitFor(pause, context); !waited)
            return failed(Kind::kCancelled, waited.error());
        outcome = attempt();
    }
    return outcome;
}

bool isTransient(ErrorCode code) noexcept {
    return code == ErrorCode::kStorage || code == ErrorCode::kStorageFull || code == ErrorCode::kUnavailable;
}

Error errorOfException() {
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return {ErrorCode::kOutOfMemory, "not enough memory to segment this scan"};
    } catch (const std::exception& error) {
        return {ErrorCode::kInternal, std::string("segmentation threw: ") + error.what()};
    } catch (...) {
        return {ErrorCode::kInternal, "segmentation threw an exception of unknown type"};
    }
}

}  // namespace shapedb::ingest
