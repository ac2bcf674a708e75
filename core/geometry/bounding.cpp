// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/bounding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/geometry/convex_hull.h"
#include "core/geometry/motion.h"
#include "core/geometry/vec3x2.h"

namespace shapedb {

namespace {

// The search: descents from many random rotations, coarse ones on an outline of the hull, then fine
// ones from the best of them on all its vertices.
//
// A box turned by 90 degrees is the same box, so only 1/24 of all rotations differ: there this many
// starts lie about 12 degrees apart.
constexpr int kStarts = 400;
constexpr double kFirstStep = 0.1;     // radians, half the distance between starts
constexpr double kRefineStep = 0.004;  // radians; enough to tell basins apart
constexpr double kLastStep = 1e-5;     // radians; the diagonal moves by less than this share
constexpr std::size_t kCoarseDescents = 120;
constexpr std::size_t kFineDescents = 12;

// The diagonal has creases, where a face of the box passes from one vertex to another, and along them
// only a few directions lead down. So this many random turns must fail before the step is halved.
constexpr int kTriesPerStep = 24;

// The outline: the farthest hull vertex in each of this many directions.
constexpr int kCoarseDirections = 1500;

// The range of the points along each edge of a box.
struct Extent {
    std::array<double, 3> low = {INFINITY, INFINITY, INFINITY};
    std::array<double, 3> high = {-INFINITY, -INFINITY, -INFINITY};

    double squaredDiagonal() const {
        double sum = 0.0;
        for (std::size_t i = 0; i < 3; ++i) sum += (high[i] - low[i]) * (high[i] - low[i]);
        return sum;
    }
};

// Points two by two; a last one left over is doubled.
std::vector<Vec3x2> inPairs(const PointCloud& points) {
    std::vector<Vec3x2> pairs;
    for (std::size_t i = 0; i < points.size(); i += 2) {
        pairs.emplace_back(points[i], points[std::min(i + 1, points.size() - 1)]);
    }
    return pairs;
}

Double2 along(const std::array<double, 3>& axis, const Vec3x2& p) {
    return axis[0] * p.x + axis[1] * p.y + axis[2] * p.z;
}

// Of the box whose edges lie along the rows of `axes`.
template <typename Pairs>
Extent extentOf(const Pairs& pairs, const Matrix3& axes) {
    std::array<Double2, 3> low = {INFINITY, INFINITY, INFINITY};
    std::array<Double2, 3> high = {-INFINITY, -INFINITY, -INFINITY};
    for (const Vec3x2& p : pairs) {
        for (std::size_t i = 0; i < 3; ++i) {
            const Double2 v = along(axes[i], p);
            low[i] = lesser(v, low[i]);
            high[i] = greater(v, high[i]);
        }
    }
    Extent extent;
    for (std::size_t i = 0; i < 3; ++i) {
        extent.low[i] = std::min(low[i].low(), low[i].high());
        extent.high[i] = std::max(high[i].low(), high[i].high());
    }
    return extent;
}

// Measures boxes of which only those below a limit matter. The points that touched earlier boxes rule
// out most of the others without a look at the rest.
class BoxTrial {
  public:
    explicit BoxTrial(const std::vector<Vec3x2>& points) : points_(points) { known_.fill(points.front()); }

    // The squared diagonal; where that is not below the limit, perhaps a smaller value that is not below
    // it either. (Fewer points never need a larger box, and rounding keeps that order.)
    double squaredDiagonal(const Matrix3& axes, double limit) {
        const double least = extentOf(known_, axes).squaredDiagonal();
        if (least >= limit) return least;
        const Extent extent = extentOf(points_, axes);
        rememberTouching(axes, extent);
        return extent.squaredDiagonal();
    }

  private:
    static constexpr std::size_t kKnown = 24;

    void rememberTouching(const Matrix3& axes, const Extent& extent) {
        for (const Vec3x2& p : points_) {
            unsigned inside = 3;
            for (std::size_t i = 0; i < 3; ++i) {
                const Double2 v = along(axes[i], p);
                inside &= less(extent.low[i], v) & less(v, extent.high[i]);
            }
            if (inside != 3) remember(p);
        }
    }

    void remember(const Vec3x2& p) {
        const auto same = [&](const Vec3x2& q) { return q.low() == p.low() && q.high() == p.high(); };
        if (std::none_of(known_.begin(), known_.end(), same)) known_[next_++ % kKnown] = p;
    }

    const std::vector<Vec3x2>& points_;
    std::array<Vec3x2, kKnown> known_;
    std::size_t next_ = 0;
};

Result<PointCloud> farthestVertices(const PointCloud& vertices, const RunContext& context) {
    if (vertices.size() <= static_cast<std::size_t>(kCoarseDirections)) return vertices;
    Random random(2);
    std::vector<std::uint8_t> taken(vertices.size(), 0);
    for (int i = 0; i < kCoarseDirections; ++i) {
        RETURN_IF_ERROR(context.checkpoint());
        const Point3 direction = randomDirection(random);
        const auto farthest = std::max_element(
            vertices.begin(), vertices.end(),
            [&](const Point3& a, const Point3& b) { return dot(a, direction) < dot(b, direction); });
        taken[static_cast<std::size_t>(farthest - vertices.begin())] = 1;
    }
    PointCloud chosen;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (taken[i]) chosen.push_back(vertices[i]);
    }
    return chosen;
}

// Turns every row of `axes` by `angle` about the unit vector `about` (Rodrigues).
Matrix3 turned(const Matrix3& axes, const Point3& about, double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    Matrix3 result;
    for (std::size_t i = 0; i < 3; ++i) {
        const Point3 row{axes[i][0], axes[i][1], axes[i][2]};
        const Point3 moved = c * row + s * cross(about, row) + ((1.0 - c) * dot(about, row)) * about;
        result[i] = {moved.x, moved.y, moved.z};
    }
    return result;
}

struct OrientedBox {
    double squaredDiagonal = 0.0;
    Matrix3 axes;
};

OrientedBox descend(const std::vector<Vec3x2>& points, OrientedBox box, double firstStep, double lastStep,
                    Random& random) {
    BoxTrial trial(points);
    for (double step = firstStep; step > lastStep; step *= 0.5) {
        for (int failures = 0; failures < kTriesPerStep;) {
            const Matrix3 candidate = turned(box.axes, randomDirection(random), step * random.uniform());
            const double value = trial.squaredDiagonal(candidate, box.squaredDiagonal);
            if (value < box.squaredDiagonal) {
                box = {value, candidate};
                failures = 0;
            } else {
                ++failures;
            }
        }
    }
    return box;
}

void sortBySize(std::vector<OrientedBox>& boxes) {
    std::sort(boxes.begin(), boxes.end(), [](const OrientedBox& a, const OrientedBox& b) {
        return a.squaredDiagonal < b.squaredDiagonal;
    });
}

Result<double> leastSquaredDiagonal(const PointCloud& vertices, const RunContext& context) {
    const std::vector<Vec3x2> all = inPairs(vertices);
    const auto farthest = farthestVertices(vertices, context);
    RETURN_IF_ERROR(farthest);
    const std::vector<Vec3x2> outline = inPairs(*farthest);
    Random random(1);
    std::vector<OrientedBox> boxes(kStarts);
    for (OrientedBox& box : boxes) {
        box.axes = randomRotation(random);
        box.squaredDiagonal = extentOf(outline, box.axes).squaredDiagonal();
    }
    sortBySize(boxes);
    boxes.resize(kCoarseDescents);
    for (OrientedBox& box : boxes) {
        RETURN_IF_ERROR(context.checkpoint());
        box = descend(outline, box, kFirstStep, kRefineStep, random);
    }
    sortBySize(boxes);
    boxes.resize(kFineDescents);
    double least = INFINITY;
    for (OrientedBox& box : boxes) {
        RETURN_IF_ERROR(context.checkpoint());
        box.squaredDiagonal = extentOf(all, box.axes).squaredDiagonal();
        least = std::min(least, descend(all, box, kFirstStep, kLastStep, random).squaredDiagonal);
    }
    return least;
}

}  // namespace

Result<double> smallestBoxDiagonal(const PointCloud& points, const RunContext& context) {
    if (points.empty()) return fail(ErrorCode::kInvalidArgument, "no points to bound");
    try {
        const PointCloud candidates = cullHullInterior(points);
        RETURN_IF_ERROR(context.checkpoint());
        const auto least = leastSquaredDiagonal(convexHullVertices(candidates), context);
        RETURN_IF_ERROR(least);
        return std::sqrt(*least);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to bound the points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("bounding box: ") + e.what());
    }
}

}  // namespace shapedb
