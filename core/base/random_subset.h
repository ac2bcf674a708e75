// SPDX-License-Identifier: Apache-2.0
// Some of many, each subset as likely as any other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/base/random.h"

namespace shapedb {

/// `most` of the numbers below `count`, or all if there are no more, in ascending order (selection sampling,
/// Knuth 3.4.2, algorithm S). Advances `random` once for each number looked at.
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
