// SPDX-License-Identifier: GPL-3.0-or-later
// Which surface point is nearest to any place, read from a table. For the sources of this folder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/float8.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Points and normals, one array for each coordinate.
struct SurfaceColumns {
    std::vector<float> x, y, z;
    std::vector<float> nx, ny, nz;

    void add(const Point3& p, const Point3& normal);
};

/// A grid of cubic cells over the box of the points and some margin. Each cell knows the point nearest to its
/// middle; in a few per cent of the cells, most of them far from all points, one that is up to half a cell
/// further. A place outside the grid takes the cell of the border that is nearest to it.
class NearestGrid {
  public:
    /// Builds the grid of the first `count` points (1 to 65,535), which lie within `half` of the origin on
    /// each axis and have a box of diagonal 1.
    void build(const SurfaceColumns& points, std::size_t count, const Point3& half);

    /// The cell of a place is trunc(scale() * place + offset), each coordinate clamped to [0, last].
    float scale() const { return scale_; }
    const std::array<float, 3>& offset() const { return offset_; }
    const std::array<std::int32_t, 3>& cells() const { return cells_; }

    std::size_t size() const { return nearest_.size(); }

    /// By cell (z * cells[1] + y) * cells[0] + x: index of the nearest point.
    const std::uint16_t* nearest() const { return nearest_.data(); }
    /// By cell: 255 where a point is, falling towards 0 with the distance from the nearest one.
    const std::uint8_t* closeness() const { return closeness_.data(); }

    /// A point and its normal, side by side in memory.
    struct alignas(32) Entry {
        float x, y, z, unused1;
        float nx, ny, nz, unused2;
    };
    const Entry* entries() const { return entries_.data(); }

  private:
    void fillNearest(const Point3& low);
    void fillCloseness(const Point3& low);

    float scale_ = 1.0f;
    std::array<float, 3> offset_{};
    std::array<std::int32_t, 3> cells_{};
    std::vector<std::uint16_t> nearest_;
    std::vector<std::uint8_t> closeness_;
    std::vector<Entry> entries_;
};

SHAPEDB_LANES Int8 clampedCells(const Float8& v, std::int32_t cells) {
    const Float8 last = allLanes(static_cast<float>(cells - 1));
    return __builtin_convertvector(lesser(greater(v, Float8{}), last), Int8);
}

/// Cells of eight places; the arguments are scale * place + offset.
SHAPEDB_LANES Int8 cellsAt(const NearestGrid& grid, const Float8& x, const Float8& y, const Float8& z) {
    const auto& n = grid.cells();
    return (clampedCells(z, n[2]) * n[1] + clampedCells(y, n[1])) * n[0] + clampedCells(x, n[0]);
}

}  // namespace shapedb
