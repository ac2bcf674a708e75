// SPDX-License-Identifier: GPL-3.0-or-later
// Which worker a vertex or a cell belongs to: what lets workers insert points side by side without locks.
#pragma once

#include <array>
#include <cstdint>

#include "core/delaunay/cell.h"

namespace shapedb {

/// One worker's view of who owns what. Every vertex belongs to exactly one worker, the vertex at infinity to
/// nobody. A cell belongs to the worker that owns at least three of its vertices; without such a worker it is
/// shared.
///
/// The rules, which everything in bowyer_watson.cpp keeps while workers run:
///   1. A worker creates and frees cells, and writes vertices, marks and balls, only of its own.
///   2. It reads or writes a neighbour entry, of its own or a shared cell, only behind a facet of which it
///      owns two vertices.
///
/// Why that is enough. Two workers cannot both own two of a facet's three vertices, so by rule 2 no neighbour
/// entry is ever touched by two workers. Every facet of a cell of mine has two vertices of mine, so what lies
/// behind it is mine or shared, never another worker's; and vertices and balls of shared cells do not change,
/// by rule 1. A new cell has a facet of the cavity, two vertices of which are mine, and the point inserted,
/// which is mine: it is mine. docs/delaunay.md proves that the outcome is that of inserting one point after
/// another.
struct Ownership {
    const std::uint8_t* workerOf = nullptr;  ///< by vertex
    std::uint8_t worker = 0;
    std::uint32_t soleOwnerMark = 0;  ///< kSoleOwner while cells carry that mark, 0 while it means nothing

    bool ownsVertex(std::uint32_t v) const { return v != kInfinite && workerOf[v] == worker; }
    /// Rule 2: whether the neighbour behind the facet a, b, c may be touched.
    bool ownsTwoOf(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        return count(a) + count(b) + count(c) >= 2;
    }
    bool ownsCell(const std::array<std::uint32_t, 4>& corners) const { return count(corners) >= 3; }
    bool ownsAllOf(const std::array<std::uint32_t, 4>& corners) const { return count(corners) == 4; }

  private:
    unsigned count(std::uint32_t v) const { return ownsVertex(v) ? 1 : 0; }
    unsigned count(const std::array<std::uint32_t, 4>& v) const {
        return count(v[0]) + count(v[1]) + count(v[2]) + count(v[3]);
    }
};

}  // namespace shapedb
