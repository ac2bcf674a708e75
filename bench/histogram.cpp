// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/histogram.h"

#include <cmath>
#include <cstddef>

namespace shapedb::bench {

double l1Distance(const Histogram& a, const Histogram& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(static_cast<double>(a[i]) - b[i]);
    return sum;
}

double chiSquareDistance(const Histogram& a, const Histogram& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double total = static_cast<double>(a[i]) + b[i];
        if (total <= 0.0) continue;
        const double difference = static_cast<double>(a[i]) - b[i];
        sum += difference * difference / total;
    }
    return sum;
}

}  // namespace shapedb::bench
