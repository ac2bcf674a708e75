// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/views.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "core/base/return_if_error.h"
#include "core/geometry/principal_axes.h"
#include "core/views/view_signature.h"

namespace shapedb {

namespace {

// Points that a pixel of the depth buffer holds on average: enough to keep the back from shining through.
constexpr double kScanPerPixel = 16.0;
constexpr double kSurfacePerPixel = 8.0;
constexpr const char* kStage = "views";

// About the centre and in the unit of the surface: far from the origin no digit is lost.
SeenSurface inOwnFrame(const SurfacePoints& surface) {
    SeenSurface all;
    all.points.reserve(surface.size());
    all.normals.reserve(surface.size());
    for (const PackedSurfacePoint& p : surface.points) {
        all.points.push_back({static_cast<double>(p.position[0]) / kSurfaceSteps,
                              static_cast<double>(p.position[1]) / kSurfaceSteps,
                              static_cast<double>(p.position[2]) / kSurfaceSteps});
        all.normals.push_back(unpackNormal(p.normal));
    }
    return all;
}

// A direction given along the principal axes, shortest first.
Point3 alongAxes(const Matrix3& axes, const Point3& direction) {
    const auto axis = [&](std::size_t row) { return Point3{axes[row][0], axes[row][1], axes[row][2]}; };
    return direction.x * axis(2) + direction.y * axis(1) + direction.z * axis(0);
}

// The corners of a dodecahedron. Changing the sign of an axis permutes them, so that it makes no difference
// which end of a principal axis is which.
std::array<Point3, kViews> corners() {
    const double golden = 0.5 * (1.0 + std::sqrt(5.0));
    std::array<Point3, kViews> found;
    std::size_t i = 0;
    for (const double a : {-1.0, 1.0}) {
        for (const double b : {-1.0, 1.0}) {
            found[i++] = {0.0, a / golden, b * golden};
            found[i++] = {a / golden, b * golden, 0.0};
            found[i++] = {b * golden, 0.0, a / golden};
            found[i++] = {a, b, -1.0};
            found[i++] = {a, b, 1.0};
        }
    }
    for (Point3& corner : found) corner = (1.0 / length(corner)) * corner;
    return found;
}

}  // namespace

Result<ViewSet> makeViews(const SurfacePoints& surface, const PointCloud& scan, const RunContext& context) {
    try {
        const SeenSurface all = inOwnFrame(surface);
        PointCloud hiding;
        hiding.reserve(scan.size());
        for (const Point3& p : scan) hiding.push_back((1.0 / surface.unit) * (p - surface.centre));
        const Matrix3 axes = principalAxes(all.points);
        const auto directions = corners();
        ViewSet set;
        for (std::size_t i = 0; i < kViews; ++i) {
            RETURN_IF_ERROR(context.checkpoint());
            context.report(kStage, i, kViews);
            const Point3 towards = alongAxes(axes, directions[i]);
            const SeenSurface seen = hiding.empty()
                                         ? visiblePoints(all, all.points, towards, kSurfacePerPixel)
                                         : visiblePoints(all, hiding, towards, kScanPerPixel);
            set.views[i] = viewSignature(seen, towards, surface.unit);
        }
        return set;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the views of a shape");
    }
}

Result<ViewSignature> makeViewOfScan(const SurfacePoints& surface, const Point3& towards) {
    try {
        return viewSignature(inOwnFrame(surface), towards, surface.unit);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the view of a scan");
    }
}

Result<double> seenShare(const SurfacePoints& surface) {
    try {
        const SeenSurface all = inOwnFrame(surface);
        const Matrix3 axes = principalAxes(all.points);
        std::size_t most = 0;
        const auto look = [&](const Point3& towards) {
            most = std::max(most, visiblePoints(all, all.points, towards, kSurfacePerPixel).points.size());
        };
        for (const Point3& corner : corners()) look(alongAxes(axes, corner));
        look(alongAxes(axes, {1, 0, 0}));
        look(alongAxes(axes, {-1, 0, 0}));
        return static_cast<double>(most) / static_cast<double>(all.points.size());
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to look at a scan");
    }
}

}  // namespace shapedb
