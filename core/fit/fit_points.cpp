// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/fit_points.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/box.h"
#include "core/geometry/principal_axes.h"

namespace shapedb {

namespace {

constexpr std::size_t kSpacingSamples = 100;
constexpr int kHullDirections = 80;

// Over every n-th point; a search tree for all of them would take longer than all else here.
float meanSpacing(const SurfaceColumns& points, std::size_t count) {
    const std::size_t step = std::max<std::size_t>(1, count / kSpacingSamples);
    double sum = 0.0;
    std::size_t samples = 0;
    for (std::size_t i = 0; i < count; i += step, ++samples) {
        // Eight at a time; the columns are filled up by points repeated, at no distance from themselves.
        Float8 least = allLanes(INFINITY);
        for (std::size_t j = 0; j < points.x.size(); j += kFloatLanes) {
            const Float8 x = loadLanes(&points.x[j]) - points.x[i];
            const Float8 y = loadLanes(&points.y[j]) - points.y[i];
            const Float8 z = loadLanes(&points.z[j]) - points.z[i];
            const Float8 d = x * x + y * y + z * z;
            least = lesser(least, d > 0.0f ? d : allLanes(INFINITY));
        }
        float nearest = least[0];
        for (std::size_t lane = 1; lane < kFloatLanes; ++lane) nearest = std::min(nearest, least[lane]);
        sum += static_cast<double>(std::sqrt(nearest));
    }
    return static_cast<float>(sum / static_cast<double>(samples));
}

}  // namespace

FitPoints::FitPoints(const SurfacePoints& surface) {
    // In the frame of the set first, where coordinates are about 1 whatever the scan's units.
    PointCloud points;
    for (const PackedSurfacePoint& p : surface.points) {
        constexpr double kStep = 1.0 / kSurfaceSteps;
        points.push_back({kStep * p.position[0], kStep * p.position[1], kStep * p.position[2]});
    }
    const Matrix3 axes = principalAxes(points);
    for (Point3& p : points) p = rotate(axes, p);
    const Box box = boxOf(points);
    const Point3 middle = 0.5 * (box.low + box.high);
    const double unit = box.diagonal();
    for (Point3& p : points) p = (1.0 / unit) * (p - middle);
    half = (0.5 / unit) * box.extent();
    toScan.rotation = transposed(axes);
    toScan.scale = surface.unit * unit;
    toScan.translation = surface.centre + surface.unit * rotate(toScan.rotation, middle);

    for (const Point3& p : points) mean = mean + p;
    mean = (1.0 / static_cast<double>(points.size())) * mean;
    for (const Point3& p : points) {
        const Point3 d = p - mean;
        const std::array<double, 3> v = {d.x, d.y, d.z};
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                covariance[i][j] += v[i] * v[j] / static_cast<double>(points.size());
            }
        }
    }

    const std::size_t padded = (points.size() + kFloatLanes - 1) / kFloatLanes * kFloatLanes;
    for (std::size_t i = 0; i < padded; ++i) {
        const std::size_t at = i % points.size();
        columns.add(points[at], rotate(axes, surface.normal(at)));
    }
    grid.build(columns, points.size(), half);
    spacing = meanSpacing(columns, points.size());
}

void FitPoints::findHull() {
    insideHull.assign(grid.size(), 1);
    for (int i = 0; i < kHullDirections; ++i) {
        const Point3 direction = evenDirection(i, kHullDirections);
        const auto dx = static_cast<float>(direction.x);
        const auto dy = static_cast<float>(direction.y);
        const auto dz = static_cast<float>(direction.z);
        float reach = -1.0f;
        for (std::size_t p = 0; p < size(); ++p) {
            reach = std::max(reach, dx * columns.x[p] + dy * columns.y[p] + dz * columns.z[p]);
        }
        const auto& cells = grid.cells();
        const auto& o = grid.offset();
        const float cell = 1.0f / grid.scale();
        const auto middle = [&](std::int32_t c, float offset) {
            return cell * (static_cast<float>(c) + 0.5f - offset);
        };
        std::uint8_t* inside = insideHull.data();
        for (std::int32_t z = 0; z < cells[2]; ++z) {
            for (std::int32_t y = 0; y < cells[1]; ++y) {
                const float row = reach - dz * middle(z, o[2]) - dy * middle(y, o[1]);
                for (std::int32_t x = 0; x < cells[0]; ++x, ++inside) {
                    *inside = static_cast<std::uint8_t>(*inside & (dx * middle(x, o[0]) <= row ? 1 : 0));
                }
            }
        }
    }
}

float FitPoints::spacingOf(std::size_t count) const {
    return spacing * std::sqrt(static_cast<float>(size()) / static_cast<float>(count));
}

}  // namespace shapedb
