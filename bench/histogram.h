// SPDX-License-Identifier: GPL-3.0-or-later
// Histograms as descriptors and the usual distances between them.
#pragma once

#include <vector>

namespace shapedb::bench {

/// Values of at least 0, all finite.
using Histogram = std::vector<float>;

// Both take histograms of the same size and give 0 for equal ones; symmetric bit for bit.
/// Sum of |a - b|.
[[nodiscard]] double l1Distance(const Histogram& a, const Histogram& b);
/// Sum of (a - b)^2 / (a + b) over the bins that are not both 0.
[[nodiscard]] double chiSquareDistance(const Histogram& a, const Histogram& b);

}  // namespace shapedb::bench
