// How coarsely the bins of the statistics are kept: four bits each, so that a search reads half the
// memory. docs/signature.md has what it costs (nothing that noise does not).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace shapedb {

/// A bin of share s (of the whole, [0, 1]) has level 15 sqrt(2 s), rounded and at most 15: half of
/// everything in one bin is as much as can be told. Persisted.
constexpr std::uint8_t kTopLevel = 15;

/// By how much the square root of a share rises from one level to the next.
constexpr double kRootPerLevel = 0.70710678118654752 / kTopLevel;

/// Of a square root in steps of 1/255, as signatures of version 2 keep it.
inline std::uint8_t levelOfRootByte(std::uint8_t root) {
    const long level = std::lround(root / 255.0 / kRootPerLevel);
    return static_cast<std::uint8_t>(std::min<long>(level, kTopLevel));
}

/// By way of version 2's steps, so that a stored signature of version 2 and one made anew agree.
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
