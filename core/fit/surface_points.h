// SPDX-License-Identifier: GPL-3.0-or-later
// A scan reduced to what aligning it needs: some 1,500 points spread evenly over its surface, with normals.
//
// They are stored beside the signature of a shape (core/fit/surface_points_codec.h) and read only for the few
// shapes that a search wants to verify (core/fit/fit.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

/// A point and its normal as they are stored: 8 bytes.
struct PackedSurfacePoint {
    std::array<std::int16_t, 3> position{};  ///< of kSurfaceSteps, in the frame of the set
    /// The normal by octahedral projection, -127 to 127 each. Its sign means nothing: that of n and -n is
    /// stored which points up (z, then y, then x).
    std::array<std::int8_t, 2> normal{};

    friend bool operator==(const PackedSurfacePoint& a, const PackedSurfacePoint& b) {
        return a.position == b.position && a.normal == b.normal;
    }
};

/// Positions are stored as multiples of one over this, from -1 to 1.
constexpr int kSurfaceSteps = 32767;

/// The most points that are kept of a scan.
constexpr std::size_t kMostSurfacePoints = 1500;

/// Surface points in farthest-point order: each lies as far as possible from all before it, so that the
/// first n are an even, coarser set.
struct SurfacePoints {
    Point3 centre;      ///< of the frame: middle of the box of the points, scan units
    double unit = 1.0;  ///< scan units per unit of the frame, finite, above 0
    /// Largest coordinate in the frame: 1, up to rounding.
    std::vector<PackedSurfacePoint> points;

    std::size_t size() const { return points.size(); }
    /// Scan units.
    [[nodiscard]] Point3 position(std::size_t i) const;
    /// A unit vector; its sign means nothing.
    [[nodiscard]] Point3 normal(std::size_t i) const;
};

/// The surface points of a scan: means of the points in the cells of a cubic grid, as fine as gives at most
/// kMostSurfacePoints; all points of a scan that has no more. Clusters that hold less than 2 % of the points
/// and that a gap separates from the rest are left out first. Normals are those of the plane through the
/// ten nearest surface points.
///
/// Depends on the points alone, not on their order or on threads. A scan in a plane is allowed.
///
/// Errors: those of `frameOf` (core/preparation/frame.h: fewer than 4 points, NaN, infinite or huge
/// coordinates, all points equal); kTooFewPoints (fewer than 4 distinct); kCollinear; kOutOfMemory;
/// kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<SurfacePoints> makeSurfacePoints(const PointCloud& scan, const RunContext& context = {});

/// Moves the points, which keep their places in the frame: adds to every position, scan units.
void moveBy(const Point3& offset, SurfacePoints& surface);

/// The two numbers that stand for a unit normal, and the normal they stand for.
[[nodiscard]] std::array<std::int8_t, 2> packNormal(const Point3& normal);
[[nodiscard]] Point3 unpackNormal(const std::array<std::int8_t, 2>& packed);

}  // namespace shapedb
