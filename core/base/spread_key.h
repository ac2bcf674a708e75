// SPDX-License-Identifier: Apache-2.0
// Hashing of keys whose bits differ in few places, such as the packed indices of a grid.
#pragma once

#include <cstdint>

namespace shapedb {

/// 32 bits, the lowest of which choose the slot in a hash table of a power of two. Each depends on every bit
/// of the key: one multiplication alone carries nothing from the high bits of a key to the low bits of the
/// hash.
[[nodiscard]] inline std::uint64_t spreadKey(std::uint64_t key) {
    std::uint64_t mixed = key * 0x9e3779b97f4a7c15ULL;
    mixed = (mixed ^ mixed >> 32) * 0xd6e8feb86659fd93ULL;
    return mixed >> 32;
}

}  // namespace shapedb
