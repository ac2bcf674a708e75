// SPDX-License-Identifier: GPL-3.0-or-later
// The four bits in which bins of statistics are kept: half the memory for a search to read, and no more
// loss than from noise (docs/signature.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace shapedb {

/// A bin with share s of the whole has level 15 sqrt(2 s), rounded, and at most 15, the level of one half and
/// more. Persisted.
constexpr std::uint8_t kTopLevel = 15;

/// The step of the square root of the share from one level to the next.
constexpr double kRootPerLevel = 0.70710678118654752 / kTopLevel;

/// Level of a square root in steps of 1/255, the form in signatures of version 2.
inline std::uint8_t levelOfRootByte(std::uint8_t root) {
    const long level = std::lround(root / 255.0 / kRootPerLevel);
    return static_cast<std::uint8_t>(std::min<long>(level, kTopLevel));
}

/// Level of a share in [0, 1]. By way of the steps of version 2, so that stored signatures of that version
/// agree with new ones.
inline std::uint8_t levelOf(double share) {
    return levelOfRootByte(
        static_cast<std::uint8_t>(std::lround(255.0 * std::sqrt(std::clamp(share, 0.0, 1.0)))));
}

/// The share a level stands for, [0, 1/2].
inline double shareOfLevel(std::uint8_t level) {
    const double root = level * kRootPerLevel;
    return root * root;
}

}  // namespace shapedb
