// SPDX-License-Identifier: GPL-3.0-or-later
// The interior on a fine grid that knows where its surface runs between two voxels: for straight lines that
// must stay inside.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/signature/interior_view.h"

namespace shapedb {

/// Voxels are inside when their centre is. Two neighbours inside are linked when the straight line between
/// their centres is, apart from a gap of at most kWidestGap of it: limbs that pass close by each other stay
/// separate, flat tetrahedra left out of the interior do not matter. Where a shape is thinner than a voxel,
/// the voxels that hold its matter count as inside.
///
/// Read from the facets between inside and outside: no tetrahedron inside has a say, however long or flat.
class InteriorGrid {
  public:
    static constexpr std::uint32_t kNoVoxel = std::numeric_limits<std::uint32_t>::max();
    static constexpr std::size_t kMostVoxels = std::size_t{1} << 18;
    static constexpr double kWidestGap = 0.25;  ///< share of the way from one centre to the next
    static constexpr double kThin = 1.0;        ///< radius of balls that mark thin matter, in voxels

    using Place = std::array<std::int32_t, 3>;  ///< of a voxel along each axis

    /// A point of the interior; all points stand for the same volume.
    struct Matter {
        std::uint32_t tetrahedron;
        std::uint32_t voxel;  ///< that holds it, or an adjacent one inside; kNoVoxel when there is none
    };
    static constexpr std::size_t kMatter = 16384;

    /// `side` is that of a voxel; larger where the grid would have more than kMostVoxels.
    InteriorGrid(const InteriorView& view, double side);

    [[nodiscard]] double side() const { return side_; }
    [[nodiscard]] std::size_t size() const { return links_.size(); }

    [[nodiscard]] bool inside(std::uint32_t voxel) const { return (links_[voxel] & kInside) != 0; }
    /// Whether the next voxel along `axis` is linked to this one.
    [[nodiscard]] bool linked(std::uint32_t voxel, std::size_t axis) const {
        return (links_[voxel] & (1U << axis)) != 0;
    }
    /// What to add to an index to get to the next voxel along `axis`.
    [[nodiscard]] std::uint32_t stride(std::size_t axis) const { return stride_[axis]; }
    [[nodiscard]] Place placeOf(std::uint32_t voxel) const;
    [[nodiscard]] Point3 centreOf(std::uint32_t voxel) const;
    /// The voxel that holds p, kNoVoxel outside the grid.
    [[nodiscard]] std::uint32_t voxelAt(const Point3& p) const;

    /// Volume of the matter in a voxel that is inside.
    [[nodiscard]] double volumeOf(std::uint32_t voxel) const;
    [[nodiscard]] const std::vector<Matter>& matter() const { return matter_; }

    /// Whether the straight line from a to b stays inside, as far as the voxels can tell. Symmetric but for
    /// rounding.
    [[nodiscard]] bool sees(const Point3& a, const Point3& b) const;

  private:
    static constexpr std::uint8_t kInside = 8;
    static constexpr std::uint8_t kForced = 16;

    // What the surface does between a centre and the next along each axis.
    struct Crossings;

    void layOut(const InteriorView& view, double side);
    void crossSurface(const InteriorView& view, Crossings& crossings) const;
    void crossFacet(const InteriorView& view, const std::array<std::uint32_t, 3>& facet, std::size_t axis,
                    Crossings& crossings) const;
    void fill(const Crossings& crossings);
    void sampleMatter(const InteriorView& view);
    [[nodiscard]] std::uint32_t insideBeside(std::uint32_t voxel, const Point3& p) const;
    void link(const Crossings& crossings);
    void measureClearance();
    [[nodiscard]] bool joined(std::uint32_t voxel, const Place& way) const;
    [[nodiscard]] std::uint32_t indexOf(const Place& p) const {
        return static_cast<std::uint32_t>(p[0]) * stride_[0] + static_cast<std::uint32_t>(p[1]) * stride_[1] +
               static_cast<std::uint32_t>(p[2]);
    }
    [[nodiscard]] Point3 inVoxels(const Point3& p) const { return (1.0 / side_) * (p - low_); }

    Point3 low_;  // centre of the first voxel
    double side_ = 1.0;
    Place count_{};
    std::array<std::uint32_t, 3> stride_{};
    std::vector<std::uint8_t> links_;      // bits: linked along each axis, inside, forced
    std::vector<std::uint8_t> clearance_;  // steps to the nearest outside or with a link missing; 0: outside
    std::vector<Matter> matter_;
    std::vector<std::uint32_t> forced_;        // sorted
    std::vector<std::uint32_t> forcedMatter_;  // points of matter in each
    double volumePerPoint_ = 0.0;
};

}  // namespace shapedb
