// Order statistics of measured times.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace shapedb::bench {

/// Value below which `share` of the values lie (the smallest such value); 0 when there are none.
[[nodiscard]] inline double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

[[nodiscard]] inline double median(std::vector<double> values) { return percentile(std::move(values), 0.5); }

/// Median of the ratios of values measured one after the other: a machine that changes its speed from round
/// to round moves it less than the ratio of medians. Both have as many.
[[nodiscard]] inline double medianRatio(const std::vector<double>& of, const std::vector<double>& to) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < of.size(); ++i) ratios.push_back(of[i] / to[i]);
    return median(std::move(ratios));
}

}  // namespace shapedb::bench
