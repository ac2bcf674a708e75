// SPDX-License-Identifier: GPL-3.0-or-later
// The interior on a grid, for fast tests whether a place is inside.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/tetrahedron.h"
#include "core/signature/interior_view.h"

namespace shapedb {

class Voxels {
  public:
    static constexpr std::size_t kLongestSide = 64;

    /// A voxel is inside when its centre lies in an interior tetrahedron. The view must have one.
    explicit Voxels(const InteriorView& view);

    /// Fraction of the straight line from a to b that lies inside, [0, 1], in steps of about a voxel.
    [[nodiscard]] double shareInside(const Point3& a, const Point3& b) const;

    [[nodiscard]] bool inside(const Point3& p) const;

  private:
    void fill(const TetrahedronCorners& corners);

    Point3 low_;
    double side_ = 1.0;
    std::array<std::ptrdiff_t, 3> count_{};
    std::vector<std::uint8_t> inside_;
};

}  // namespace shapedb
