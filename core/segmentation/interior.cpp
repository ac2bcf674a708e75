// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/interior.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/math.h"
#include "core/base/processor.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb {

namespace {

// Whether the ball behind a hull facet is nearly the half space beyond it: its centre lies outside the hull,
// and the circle in which its sphere cuts the facet's plane is small compared to it.
bool opensToOutside(const PointCloud& points, const Tetrahedra& tetrahedra, std::size_t t, std::size_t facet,
                    double cosHullAngle) {
    const TriangleCorners corners = facetCorners(points, tetrahedra.vertices[t], facet);
    const Point3 apex = points[tetrahedra.vertices[t][facet]];
    const Point3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    // facetCorners turns one way or the other, depending on the facet, so the apex tells which side is
    // inside.
    const double inwards = dot(normal, apex - corners[0]) >= 0.0 ? 1.0 : -1.0;
    const Point3 toCentre = tetrahedra.circumcentres[t] - corners[0];
    // sin(angle) = r_facet / r_ball, so cos(angle) = distance of the centre from the plane / r_ball.
    const double beyond = -inwards * dot(normal, toCentre);
    return beyond > cosHullAngle * length(normal) * tetrahedra.circumradii[t];
}

}  // namespace

std::vector<std::uint8_t> bigBalls(const Tetrahedra& tetrahedra, const std::vector<double>& spacings,
                                   double bigBallRatio) {
    std::vector<std::uint8_t> big(tetrahedra.size());
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        const auto& v = tetrahedra.vertices[t];
        // We read the paper's "any of p_i" as "at least one of them", so the smallest spacing decides.
        const double smallest = std::min({spacings[v[0]], spacings[v[1]], spacings[v[2]], spacings[v[3]]});
        big[t] = tetrahedra.circumradii[t] > bigBallRatio * smallest ? 1 : 0;
    }
    return big;
}

double intersectionAngle(const Point3& centreA, const Point3& centreB, const Point3& shared) {
    // The angle between the radii to a common point. The law of cosines would cancel for large balls.
    const Point3 a = centreA - shared;
    const Point3 b = centreB - shared;
    return std::atan2(length(cross(a, b)), dot(a, b));
}

namespace {

// Tests intersectionAngle < angle, mostly without computing the angle.
class DeepAngle {
  public:
    explicit DeepAngle(double angle) : angle_(angle), squaredCosine_(std::cos(angle) * std::cos(angle)) {}

    bool between(const Point3& centreA, const Point3& centreB, const Point3& shared) const {
        const Point3 a = centreA - shared;
        const Point3 b = centreB - shared;
        const double product = dot(a, b);
        // The angle is below 90 degrees, so its cosine is positive.
        const double squared = product > 0.0 ? product * product : 0.0;
        const double limit = squaredCosine_ * squaredLength(a) * squaredLength(b);
        // Without a division or a square root; close calls take the angle itself.
        if (squared > (1.0 + kCosineSlack) * limit) return true;
        if (squared < (1.0 - kCosineSlack) * limit) return false;
        return intersectionAngle(centreA, centreB, shared) < angle_;
    }

  private:
    // Rounding moves the squares by less unless the angle is within 1e-4 degrees of 90.
    static constexpr double kCosineSlack = 1e-9;
    double angle_;
    double squaredCosine_;
};

// Clears `inside` wherever the walk from `layer` leads. The order makes no difference; going layer by layer
// allows prefetching.
Result<void> walkFrom(std::vector<std::uint32_t> layer, const PointCloud& points,
                      const Tetrahedra& tetrahedra, const DeepAngle& deep, const RunContext& context,
                      std::vector<std::uint8_t>& inside) {
    while (!layer.empty()) {
        RETURN_IF_ERROR(context.checkpoint());
        std::vector<std::uint32_t> following;
        for (std::size_t i = 0; i < layer.size(); ++i) {
            if (i + kPrefetchFarDistance < layer.size()) {
                prefetch(&tetrahedra.neighbours[layer[i + kPrefetchFarDistance]]);
                prefetch(&tetrahedra.vertices[layer[i + kPrefetchFarDistance]]);
            }
            if (i + kPrefetchDistance < layer.size()) {
                for (const std::uint32_t next : tetrahedra.neighbours[layer[i + kPrefetchDistance]]) {
                    prefetch(inside.data() + next);
                    prefetch(tetrahedra.circumcentres.data() + next);
                }
            }
            const std::uint32_t t = layer[i];
            for (std::size_t facet = 0; facet < 4; ++facet) {
                const std::uint32_t next = tetrahedra.neighbours[t][facet];
                // Not inside: reached before, or not big. So small balls stop the walk.
                if (next == kNoTetrahedron || !inside[next]) continue;
                const Point3& shared = points[tetrahedra.vertices[t][(facet + 1) % 4]];
                if (!deep.between(tetrahedra.circumcentres[t], tetrahedra.circumcentres[next], shared))
                    continue;
                inside[next] = 0;
                following.push_back(next);
            }
        }
        layer = std::move(following);
    }
    return {};
}

}  // namespace

Result<std::vector<std::uint8_t>> interiorTetrahedra(const PointCloud& points, const Tetrahedra& tetrahedra,
                                                     const std::vector<std::uint8_t>& big,
                                                     const SegmentationOptions& options,
                                                     const RunContext& context) {
    const DeepAngle deep(toRadians(options.deepAngleDegrees));
    const double cosHullAngle = std::cos(toRadians(options.hullAngleDegrees));
    // A ball that is not big counts as outside, and the walk takes away from the others what it reaches.
    std::vector<std::uint8_t> inside = big;
    std::vector<std::uint32_t> layer;
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        if (!big[t]) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            if (tetrahedra.neighbours[t][facet] != kNoTetrahedron) continue;
            if (!opensToOutside(points, tetrahedra, t, facet, cosHullAngle)) continue;
            inside[t] = 0;
            layer.push_back(static_cast<std::uint32_t>(t));
            break;
        }
    }
    RETURN_IF_ERROR(walkFrom(std::move(layer), points, tetrahedra, deep, context, inside));
    return inside;
}

}  // namespace shapedb
