// SPDX-License-Identifier: GPL-3.0-or-later
// What a scan shows besides one object: the table that it stands on, and other objects.
//
// All functions are pure, use no randomness but fixed seeds, and are thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

/// A plane that objects stand on: most points beside it lie on one side of it, and it reaches well beyond
/// them, to most sides. A flat face of an object does not, nor does the flat handle of a spoon, nor a wall
/// that hides nothing behind it.
struct SupportPlane {
    Point3 point;              ///< on the plane, scan units
    Point3 normal;             ///< unit vector, towards the objects
    double within = 0.0;       ///< points up to this far from it belong to it, scan units
    std::uint64_t points = 0;  ///< that belong to it
};

struct Scene {
    std::optional<SupportPlane> plane;
    /// Points of each object, most first: a group of points beside the plane with a gap to all others that is
    /// wider than the gaps between its own, and at least 2 % of the points beside the plane or a quarter of
    /// those of the largest group. At least one, unless all points are on the plane.
    std::vector<std::uint64_t> objects;
    /// For each point an index into `objects`, kOnPlane, or kNoObject where a smaller group was left out.
    std::vector<std::int32_t> objectOfPoint;
};
constexpr std::int32_t kOnPlane = -1;
constexpr std::int32_t kNoObject = -2;

/// Finds both among at least 16 points; among fewer there is one object and no plane. All points must be
/// finite. Of larger scans 20,000 points decide, and the others join their nearest neighbour.
///
/// The plane with the most points of 1,500 drawn through three points each (RANSAC, Fischler and Bolles 1981)
/// is fitted to its points by least squares; if it supports nothing the next is looked at, up to three.
///
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<Scene> findScene(const PointCloud& points, const RunContext& context = {});

/// Which part of a scene to keep.
struct IsolateOptions {
    bool dropPlane = false;  ///< leave out the plane that the objects stand on
    bool largest = false;    ///< keep the largest object alone, without the plane

    [[nodiscard]] bool any() const { return dropPlane || largest; }
    /// `objectOfPoint`: of a point of the scene.
    [[nodiscard]] bool keeps(std::int32_t objectOfPoint) const {
        return largest ? objectOfPoint == 0 : !dropPlane || objectOfPoint != kOnPlane;
    }
};

/// The points that `options` keep, and those of one object, in their order. `object`: an index into
/// `objects`.
[[nodiscard]] PointCloud isolated(const PointCloud& points, const Scene& scene,
                                  const IsolateOptions& options);
[[nodiscard]] PointCloud pointsOfObject(const PointCloud& points, const Scene& scene, std::size_t object);

}  // namespace shapedb
