#include "core/geometry/bounding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <iterator>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/convex_hull_3.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"

namespace shapedb {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

// A box turned by 90 degrees is the same box, so the rotations to search are 1/24 of all: this
// many starts lie about 12 degrees apart there.
constexpr int kStarts = 400;
constexpr std::size_t kDescents = 8;
constexpr double kFirstStep = 0.1;  // radians, half the distance between starts
constexpr double kLastStep = 1e-5;  // radians; the diagonal moves by less than this share

PointCloud hullVertices(const PointCloud& points) {
    std::vector<Kernel::Point_3> copies;
    copies.reserve(points.size());
    for (const Point3& p : points) copies.emplace_back(p.x, p.y, p.z);
    std::vector<Kernel::Point_3> extreme;
    CGAL::extreme_points_3(copies, std::back_inserter(extreme));
    PointCloud vertices;
    vertices.reserve(extreme.size());
    for (const auto& p : extreme) vertices.push_back({p.x(), p.y(), p.z()});
    // The hull's order depends on the input's; sums below must not.
    std::sort(vertices.begin(), vertices.end(), lexicographicLess);
    return vertices;
}

// Squared diagonal of the box with its edges along the rows of `axes`.
double squaredDiagonal(const PointCloud& points, const Matrix3& axes) {
    std::array<double, 3> low = {INFINITY, INFINITY, INFINITY};
    std::array<double, 3> high = {-INFINITY, -INFINITY, -INFINITY};
    for (const Point3& p : points) {
        for (std::size_t i = 0; i < 3; ++i) {
            const double v = axes[i][0] * p.x + axes[i][1] * p.y + axes[i][2] * p.z;
            low[i] = std::min(low[i], v);
            high[i] = std::max(high[i], v);
        }
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) sum += (high[i] - low[i]) * (high[i] - low[i]);
    return sum;
}

// Turns the box by `angle` about its own edge number `edge`.
Matrix3 turned(const Matrix3& axes, std::size_t edge, double angle) {
    const std::size_t a = (edge + 1) % 3;
    const std::size_t b = (edge + 2) % 3;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    Matrix3 result = axes;
    for (std::size_t i = 0; i < 3; ++i) {
        result[a][i] = c * axes[a][i] + s * axes[b][i];
        result[b][i] = c * axes[b][i] - s * axes[a][i];
    }
    return result;
}

double descend(const PointCloud& points, Matrix3 axes, double value) {
    for (double step = kFirstStep; step > kLastStep;) {
        Matrix3 best = axes;
        double bestValue = value;
        for (std::size_t edge = 0; edge < 3; ++edge) {
            for (const double angle : {step, -step}) {
                const Matrix3 candidate = turned(axes, edge, angle);
                const double candidateValue = squaredDiagonal(points, candidate);
                if (candidateValue < bestValue) {
                    best = candidate;
                    bestValue = candidateValue;
                }
            }
        }
        if (bestValue < value) {
            axes = best;
            value = bestValue;
        } else {
            step *= 0.5;
        }
    }
    return value;
}

double leastSquaredDiagonal(const PointCloud& points) {
    Random random(1);
    std::vector<std::pair<double, Matrix3>> starts;
    for (int i = 0; i < kStarts; ++i) {
        const Matrix3 axes = randomRotation(random);
        starts.emplace_back(squaredDiagonal(points, axes), axes);
    }
    std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    double least = starts.front().first;
    for (std::size_t i = 0; i < kDescents; ++i) {
        least = std::min(least, descend(points, starts[i].second, starts[i].first));
    }
    return least;
}

}  // namespace

Result<double> smallestBoxDiagonal(const PointCloud& points) {
    if (points.empty()) return fail(ErrorCode::kInvalidArgument, "no points to bound");
    try {
        return std::sqrt(leastSquaredDiagonal(hullVertices(points)));
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to bound the points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("bounding box: ") + e.what());
    }
}

}  // namespace shapedb
