// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/view_signature.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/geometry/box.h"
#include "core/geometry/depth_buffer.h"
#include "core/geometry/motion.h"
#include "core/geometry/principal_axes.h"

namespace shapedb {

namespace {

constexpr std::size_t kLeastSeen = 4;
// Points whose distances are counted, the first of the set.
constexpr std::size_t kPaired = 200;
// Added to the cosine between normal and view, so that every point has some weight.
constexpr double kLeastCosine = 0.02;

// Half the width of the grid, in units of the size across the view; what lies beyond counts in the outer
// cells. A bar reaches 1.73, a disc 1.41.
constexpr double kColumnReach = 2.2;
constexpr double kRowReach = 1.5;
constexpr double kLayerReach = 1.1;
// In units of the mean distance.
constexpr double kDistanceReach = 2.6;

// A share of 0.15, or of one half of the distances, and all above have the top level.
constexpr double kCellLevels = 2.6 * kTopViewLevel;
constexpr double kDistanceLevels = 1.4142135623730951 * kTopViewLevel;

// The two bins whose middles a place lies between, and its share of each.
struct Between {
    std::size_t low;
    std::size_t high;
    double highShare;

    // `place`: 0 to 1 over all bins.
    Between(double place, std::size_t bins) {
        const double at =
            std::clamp(place * static_cast<double>(bins) - 0.5, 0.0, static_cast<double>(bins - 1));
        low = static_cast<std::size_t>(at);
        high = std::min(low + 1, bins - 1);
        highShare = at - static_cast<double>(low);
    }
    template <typename Add>
    void each(const Add& add) const {
        add(low, 1.0 - highShare);
        add(high, highShare);
    }
};

std::uint8_t levelFor(double share, double levels) {
    return static_cast<std::uint8_t>(
        std::min<long>(kTopViewLevel, std::lround(levels * std::sqrt(std::max(share, 0.0)))));
}

Point3 thirdAxis(const PointCloud& points) {
    const std::array<double, 3> axis = principalAxes(points)[2];
    return {axis[0], axis[1], axis[2]};
}

// The points along the view: long axis, short axis, depth towards the viewer, in units of the size.
struct Viewed {
    PointCloud places;
    std::vector<double> weights;  // sum 1: shares of the outline that the points cover
    double size = 0.0;
};

Viewed viewedAlong(const SeenSurface& seen, const Point3& axis) {
    Viewed viewed;
    double total = 0.0;
    for (const Point3& n : seen.normals) {
        viewed.weights.push_back(std::abs(dot(n, axis)) + kLeastCosine);
        total += viewed.weights.back();
    }
    Point3 mean;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
        viewed.weights[i] /= total;
        mean = mean + viewed.weights[i] * seen.points[i];
    }
    const Point3 right = anyPerpendicular(axis);
    const Point3 up = cross(axis, right);
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
        const Point3 d = seen.points[i] - mean;
        const Point3 p{dot(d, right), dot(d, up), dot(d, axis)};
        viewed.places.push_back(p);
        xx += viewed.weights[i] * p.x * p.x;
        xy += viewed.weights[i] * p.x * p.y;
        yy += viewed.weights[i] * p.y * p.y;
    }
    viewed.size = std::sqrt(xx + yy);
    if (!(viewed.size > 0.0)) return viewed;
    const double turn = 0.5 * std::atan2(2.0 * xy, xx - yy);
    const double c = std::cos(turn) / viewed.size;
    const double s = std::sin(turn) / viewed.size;
    for (Point3& p : viewed.places) p = {c * p.x + s * p.y, c * p.y - s * p.x, p.z / viewed.size};
    return viewed;
}

void addCells(const Viewed& viewed, ViewSignature& view) {
    std::array<double, kViewCells> shares{};
    for (std::size_t i = 0; i < viewed.places.size(); ++i) {
        const Point3& p = viewed.places[i];
        const Between column(0.5 + p.x / (2.0 * kColumnReach), kViewColumns);
        const Between row(0.5 + p.y / (2.0 * kRowReach), kViewRows);
        const Between layer(0.5 + p.z / (2.0 * kLayerReach), kViewLayers);
        column.each([&](std::size_t x, double a) {
            row.each([&](std::size_t y, double b) {
                layer.each([&](std::size_t z, double c) {
                    shares[(x * kViewRows + y) * kViewLayers + z] += viewed.weights[i] * a * b * c;
                });
            });
        });
    }
    for (std::size_t bin = 0; bin < kViewCells; ++bin) view.setLevel(bin, levelFor(shares[bin], kCellLevels));
}

void addDistances(const Viewed& viewed, ViewSignature& view) {
    const std::size_t count = std::min(viewed.places.size(), kPaired);
    std::vector<double> distances;
    std::vector<double> weights;
    distances.reserve(count * (count - 1) / 2);
    weights.reserve(count * (count - 1) / 2);
    double total = 0.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t j = i + 1; j < count; ++j) {
            distances.push_back(std::sqrt(squaredDistance(viewed.places[i], viewed.places[j])));
            weights.push_back(viewed.weights[i] * viewed.weights[j]);
            total += weights.back();
            sum += weights.back() * distances.back();
        }
    }
    if (!(sum > 0.0)) return;
    const double perReach = total / (sum * kDistanceReach);
    std::array<double, kViewDistances> shares{};
    for (std::size_t i = 0; i < distances.size(); ++i) {
        Between(distances[i] * perReach, kViewDistances).each([&](std::size_t bin, double share) {
            shares[bin] += share * weights[i];
        });
    }
    for (std::size_t i = 0; i < kViewDistances; ++i) {
        view.setLevel(kViewCells + i, levelFor(shares[i] / total, kDistanceLevels));
    }
}

}  // namespace

void ViewSignature::setLevel(std::size_t bin, std::uint8_t value) {
    const unsigned shift = 4 * (bin % 2);
    const unsigned kept = levels[bin / 2] & (15u << (4 - shift));
    levels[bin / 2] = static_cast<std::uint8_t>(kept | (static_cast<unsigned>(value) << shift));
}

ViewSignature viewSignature(const SeenSurface& seen, const Point3& towards, double unit) {
    ViewSignature view;
    if (seen.points.size() < kLeastSeen) return view;
    Point3 axis = thirdAxis(seen.points);
    if (dot(axis, towards) < 0.0) axis = -1.0 * axis;
    const Viewed viewed = viewedAlong(seen, axis);
    const auto size = static_cast<float>(viewed.size * unit);
    if (!(size > 0.0f) || !std::isfinite(size)) return view;
    view.size = size;
    addCells(viewed, view);
    addDistances(viewed, view);
    return view;
}

ViewSignature flipped(const ViewSignature& view, const Flip& flip) {
    ViewSignature result = view;
    for (std::size_t x = 0; x < kViewColumns; ++x) {
        for (std::size_t y = 0; y < kViewRows; ++y) {
            for (std::size_t z = 0; z < kViewLayers; ++z) {
                const std::size_t fromX = flip.columns ? kViewColumns - 1 - x : x;
                const std::size_t fromY = flip.rows ? kViewRows - 1 - y : y;
                const std::size_t fromZ = flip.layers ? kViewLayers - 1 - z : z;
                result.setLevel((x * kViewRows + y) * kViewLayers + z,
                                view.level((fromX * kViewRows + fromY) * kViewLayers + fromZ));
            }
        }
    }
    return result;
}

namespace {

constexpr double kBehindPixels = 2.0;

}  // namespace

SeenSurface visiblePoints(const SeenSurface& surface, const PointCloud& hiding, const Point3& towards,
                          double perPixel) {
    if (surface.points.empty()) return {};
    const PointCloud places = alongView(surface.points, towards);
    const Box box = boxOf(places);
    const double pixel = pixelFor(box.extent(), perPixel, hiding.size());
    if (!(pixel > 0.0)) return surface;
    DepthBuffer buffer(box, pixel);
    for (const Point3& p : alongView(hiding, towards)) buffer.add(p);
    SeenSurface seen;
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (buffer.hides(places[i], kBehindPixels * pixel)) continue;
        seen.points.push_back(surface.points[i]);
        seen.normals.push_back(surface.normals[i]);
    }
    return seen;
}

}  // namespace shapedb
