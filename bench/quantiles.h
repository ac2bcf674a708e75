// SPDX-License-Identifier: GPL-3.0-or-later
// Order statistics of measured times.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace shapedb::bench {

/// Smallest value that at least `share` of the values do not exceed; 0 if there are none.
[[nodiscard]] inline double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

[[nodiscard]] inline double median(std::vector<double> values) { return percentile(std::move(values), 0.5); }

/// Median of the ratios of values measured right after each other; changes in the machine's speed affect it
/// less than the ratio of medians. Both must have the same size.
[[nodiscard]] inline double medianRatio(const std::vector<double>& of, const std::vector<double>& to) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < of.size(); ++i) ratios.push_back(of[i] / to[i]);
    return median(std::move(ratios));
}

}  // namespace shapedb::bench
