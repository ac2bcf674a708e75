// SPDX-License-Identifier: Apache-2.0
// A small seeded generator with the same stream on every platform, so that a seed in a test, a document or a
// bug report means the same points everywhere. (The results of std::normal_distribution and std::shuffle
// depend on the standard library.)
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/math.h"

namespace shapedb {

/// SplitMix64 (Steele, Lea, Flood 2014). Not for secrets. Not thread-safe: one per thread.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
        return z ^ (z >> 31);
    }

    /// Uniform in [0, 1), 53 random bits.
    double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

    /// Uniform in [low, high).
    double uniform(double low, double high) { return low + (high - low) * uniform(); }

    /// Uniform in [0, bound); bound > 0. The bias is below bound / 2^64.
    std::uint64_t below(std::uint64_t bound) {
        return static_cast<std::uint64_t>((static_cast<Wide>(next()) * bound) >> 64);
    }

    /// Standard normal (Box-Muller; the second value of each pair is kept for the next call).
    double normal() {
        if (hasSpare_) {
            hasSpare_ = false;
            return spare_;
        }
        const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
        const double angle = 2.0 * kPi * uniform();
        spare_ = radius * std::sin(angle);
        hasSpare_ = true;
        return radius * std::cos(angle);
    }

  private:
    __extension__ typedef unsigned __int128 Wide;

    std::uint64_t state_;
    double spare_ = 0.0;
    bool hasSpare_ = false;
};

/// Some of many, each subset as likely as any other: `most` of the numbers below `count`, or all if there are
/// no more, in ascending order (selection sampling, Knuth 3.4.2, algorithm S). Advances `random` once for
/// each number looked at.
[[nodiscard]] inline std::vector<std::size_t> randomSubset(std::size_t count, std::size_t most,
                                                           Random& random) {
    const std::size_t wanted = std::min(most, count);
    std::vector<std::size_t> chosen;
    chosen.reserve(wanted);
    for (std::size_t i = 0; chosen.size() < wanted; ++i) {
        if (random.below(count - i) < wanted - chosen.size()) chosen.push_back(i);
    }
    return chosen;
}

}  // namespace shapedb
