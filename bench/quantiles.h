// Order statistics of measured times.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace shapedb::bench {

/// The value below which a share q in [0, 1] of the values lies (the nearest rank); 0 of none.
inline double quantile(std::vector<double> values, double q) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace shapedb::bench
