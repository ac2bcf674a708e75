// SPDX-License-Identifier: GPL-3.0-or-later
// A tetrahedron of the triangulation while points go in, and how its vertices and facets are numbered.
#pragma once

#include <array>
#include <cstdint>

namespace shapedb {

/// The vertex at infinity. Together with a hull facet it makes a cell, so that every facet has a cell on
/// either side.
constexpr std::uint32_t kInfinite = 0x3fffffffu;
constexpr std::uint32_t kNoCell = 0xffffffffu;

// The first vertex of a cell carries two marks in its upper bits. All bits set: the cell is free.
constexpr std::uint32_t kVertexBits = 0x3fffffffu;
constexpr std::uint32_t kFreeCell = 0xffffffffu;
/// While a point goes in: its ball contains the point.
constexpr std::uint32_t kInCavity = 0x80000000u;
/// During a parallel round: all four vertices belong to one worker (ownership.h). No other worker comes
/// near such a cell, so that bit alone settles whose it is. Left over, and ignored, at other times.
constexpr std::uint32_t kSoleOwner = 0x40000000u;

/// Half a cache line. Facet i is opposite vertex i, and neighbour i lies behind it. Vertices are positively
/// oriented: det(v1 - v0, v2 - v0, v3 - v0) > 0, the vertex at infinity counting as a point far beyond the
/// other three.
struct alignas(32) Cell {
    std::array<std::uint32_t, 4> vertices;  ///< the first with marks
    std::array<std::uint32_t, 4> neighbours;

    std::uint32_t firstVertex() const { return vertices[0] & kVertexBits; }
    /// The vertices without marks.
    std::array<std::uint32_t, 4> corners() const {
        return {firstVertex(), vertices[1], vertices[2], vertices[3]};
    }
    bool isFree() const { return vertices[0] == kFreeCell; }
};

/// kFacet[i]: the vertices of facet i, in an order that makes a positive tetrahedron with any point on the
/// side of vertex i as the fourth.
constexpr std::array<std::array<std::uint32_t, 3>, 4> kFacet = {{{2, 1, 3}, {0, 2, 3}, {1, 0, 3}, {0, 1, 2}}};

/// Whether no corner is the vertex at infinity; false for a free cell. Branch-free.
inline bool isFinite(const std::array<std::uint32_t, 4>& corners) {
    return (static_cast<unsigned>(corners[0] < kInfinite) & static_cast<unsigned>(corners[1] < kInfinite) &
            static_cast<unsigned>(corners[2] < kInfinite) & static_cast<unsigned>(corners[3] < kInfinite)) !=
           0;
}

/// Where `vertex` stands among the vertices of a cell that has it. Does not read the first, so marks do not
/// matter. Branch-free: the answer is as good as random.
inline std::uint32_t indexOf(const std::array<std::uint32_t, 4>& v, std::uint32_t vertex) {
    return static_cast<std::uint32_t>(v[1] == vertex) + 2 * static_cast<std::uint32_t>(v[2] == vertex) +
           3 * static_cast<std::uint32_t>(v[3] == vertex);
}

}  // namespace shapedb
