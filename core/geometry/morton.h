// Bits of three numbers taken in turns, for keys that follow a curve or a tree of cubes through space.
#pragma once

#include <cstdint>

namespace shapedb {

/// The lowest 21 bits of `v` at every third place, from the lowest on: x << 2 | y << 1 | z of three such
/// is their Morton code.
constexpr std::uint64_t spreadBits3(std::uint64_t v) {
    v = (v | v << 32) & 0x001f00000000ffffULL;
    v = (v | v << 16) & 0x001f0000ff0000ffULL;
    v = (v | v << 8) & 0x100f00f00f00f00fULL;
    v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
    return (v | v << 2) & 0x1249249249249249ULL;
}

}  // namespace shapedb
