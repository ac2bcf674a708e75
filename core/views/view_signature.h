// SPDX-License-Identifier: GPL-3.0-or-later
// What one side of a shape looks like, in 64 bytes: where its surface lies along its own principal axes.
// docs/views.md has reasons and figures.
//
// All functions are pure and thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// Bins of a view along its long axis, across it, and in depth. Persisted.
constexpr std::size_t kViewColumns = 8;
constexpr std::size_t kViewRows = 5;
constexpr std::size_t kViewLayers = 3;
constexpr std::size_t kViewCells = kViewColumns * kViewRows * kViewLayers;
/// Bins of the distances between surface points. Persisted.
constexpr std::size_t kViewDistances = 8;
constexpr std::size_t kViewBins = kViewCells + kViewDistances;
constexpr std::size_t kViewBytes = kViewBins / 2;
/// Largest level of a bin. Persisted.
constexpr std::uint8_t kTopViewLevel = 15;

struct ViewSignature {
    /// The level of bin i, 0 to kTopViewLevel, in the low (i even) or high half of byte i / 2. First the
    /// cells, (column * kViewRows + row) * kViewLayers + layer, where layer 2 is nearest to the viewer, then
    /// the distances. Which end of an axis is column 0 or row 0 is arbitrary, but columns, rows and layers
    /// make a right-handed frame.
    std::array<std::uint8_t, kViewBytes> levels{};
    /// Root mean square distance of the seen surface from its mean across the view, scan units, above 0;
    /// 0 when nothing was seen.
    float size = 0.0f;

    [[nodiscard]] std::uint8_t level(std::size_t bin) const {
        return static_cast<std::uint8_t>((levels[bin / 2] >> (4 * (bin % 2))) & 15u);
    }
    void setLevel(std::size_t bin, std::uint8_t value);

    friend bool operator==(const ViewSignature& a, const ViewSignature& b) {
        return a.levels == b.levels && a.size == b.size;
    }
};

/// Some of a surface, evenly spread; early points are an even, coarser set (SurfacePoints).
struct SeenSurface {
    PointCloud points;
    PointCloud normals;  ///< unit vectors; their signs do not matter
};

/// The signature of a surface seen from the side of `towards`, which need not be a unit vector. The view is
/// taken along the third principal axis of the points, not along `towards`, which only tells its two ends
/// apart: so shapes scanned from somewhat different sides look alike. `unit`: scan units per unit of the
/// points. Fewer than four points give a signature of zeros.
[[nodiscard]] ViewSignature viewSignature(const SeenSurface& seen, const Point3& towards, double unit);

/// The same view with columns, rows or layers in the opposite order.
struct Flip {
    bool columns = false;
    bool rows = false;
    bool layers = false;  ///< as if seen from behind
};
[[nodiscard]] ViewSignature flipped(const ViewSignature& view, const Flip& flip);

// Which surface points a far camera sees. For the sources of this folder.

/// The points of `surface` that a depth buffer along -`towards` (a unit vector) shows: per pixel what lies at
/// most two pixels behind the nearest of `hiding`, points of the same surface, or more of them. A pixel is as
/// wide as holds `perPixel` of those on average, if the whole box of the outline were covered. Points of
/// `hiding` outside the outline of `surface` hide nothing. In their order; independent of that of `hiding`.
[[nodiscard]] SeenSurface visiblePoints(const SeenSurface& surface, const PointCloud& hiding,
                                        const Point3& towards, double perPixel);

}  // namespace shapedb
