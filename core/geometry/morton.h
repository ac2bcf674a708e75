// SPDX-License-Identifier: GPL-3.0-or-later
// Interleaving bits, for Morton codes and other keys that follow a tree of cubes.
#pragma once

#include <cstdint>

namespace shapedb {

/// Spreads the lowest 21 bits of `v` to every third bit. The Morton code of a cell is
/// spreadBits3(x) << 2 | spreadBits3(y) << 1 | spreadBits3(z).
constexpr std::uint64_t spreadBits3(std::uint64_t v) {
    v = (v | v << 32) & 0x001f00000000ffffULL;
    v = (v | v << 16) & 0x001f0000ff0000ffULL;
    v = (v | v << 8) & 0x100f00f00f00f00fULL;
    v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
    return (v | v << 2) & 0x1249249249249249ULL;
}

}  // namespace shapedb
