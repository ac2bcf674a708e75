#include "core/views/views.h"

#include <algorithm>
#include <cmath>
#include <new>

#include <Eigen/Eigenvalues>

#include "core/base/return_if_error.h"
#include "core/views/visible_points.h"

namespace shapedb {

namespace {

// Points that a pixel of the depth buffer holds on average: so many that the back does not shine through.
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

// Columns: the principal axes, shortest first.
Eigen::Matrix3d principalAxes(const PointCloud& points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Point3& p : points) mean += Eigen::Vector3d(p.x, p.y, p.z);
    mean /= static_cast<double>(points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Point3& p : points) {
        const Eigen::Vector3d v = Eigen::Vector3d(p.x, p.y, p.z) - mean;
        spread += v * v.transpose();
    }
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

// The corners of a dodecahedron. Changing the sign of an axis permutes them, so that it makes no difference
// which end of a principal axis is which.
std::array<Eigen::Vector3d, kViews> corners() {
    const double golden = 0.5 * (1.0 + std::sqrt(5.0));
    std::array<Eigen::Vector3d, kViews> found;
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
    for (Eigen::Vector3d& corner : found) corner.normalize();
    return found;
}

}  // namespace

Result<ViewSet> makeViews(const SurfacePoints& surface, const PointCloud& scan, const RunContext& context) {
    try {
        const SeenSurface all = inOwnFrame(surface);
        PointCloud hiding;
        hiding.reserve(scan.size());
        for (const Point3& p : scan) hiding.push_back((1.0 / surface.unit) * (p - surface.centre));
        const Eigen::Matrix3d axes = principalAxes(all.points);
        const auto directions = corners();
        ViewSet set;
        for (std::size_t i = 0; i < kViews; ++i) {
            RETURN_IF_ERROR(context.checkpoint());
            context.report(kStage, i, kViews);
            const Eigen::Vector3d direction = axes * directions[i];
            const Point3 towards{direction.x(), direction.y(), direction.z()};
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
        const Eigen::Matrix3d axes = principalAxes(all.points);
        std::size_t most = 0;
        const auto look = [&](const Eigen::Vector3d& direction) {
            const Point3 towards{direction.x(), direction.y(), direction.z()};
            most = std::max(most, visiblePoints(all, all.points, towards, kSurfacePerPixel).points.size());
        };
        for (const Eigen::Vector3d& corner : corners()) look(axes * corner);
        look(axes.col(0));
        look(-axes.col(0));
        return static_cast<double>(most) / static_cast<double>(all.points.size());
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to look at a scan");
    }
}

}  // namespace shapedb
