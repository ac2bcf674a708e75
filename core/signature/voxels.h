// The interior on a grid, to ask quickly whether a place is inside.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/signature/interior_view.h"

namespace shapedb {

class Voxels {
  public:
    static constexpr std::size_t kLongestSide = 64;

    /// A voxel is inside when its centre lies in an interior tetrahedron.
    explicit Voxels(const InteriorView& view);

    /// Share of the straight line from a to b that lies inside, [0, 1]; by steps of about a voxel.
    [[nodiscard]] double shareInside(const Point3& a, const Point3& b) const;

    [[nodiscard]] bool inside(const Point3& p) const;

  private:
    void fill(const Point3& a, const Point3& b, const Point3& c, const Point3& d);

    Point3 low_;
    double side_ = 1.0;
    std::array<std::ptrdiff_t, 3> count_{};
    std::vector<std::uint8_t> inside_;
};

}  // namespace shapedb
