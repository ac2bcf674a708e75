// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/histogram.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/base/random.h"

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

Result<Histogram> d2Histogram(const PointCloud& points, std::uint64_t seed, const D2Options& options) {
    if (options.pairs == 0 || options.bins == 0 || !(options.range > 0.0)) {
        return fail(ErrorCode::kInvalidArgument, "a D2 histogram needs pairs, bins and a range above 0");
    }
    if (points.empty()) return fail(ErrorCode::kTooFewPoints, "no points");
    Random random(seed);
    std::vector<double> distances(options.pairs);
    double sum = 0.0;
    for (double& value : distances) {
        const Point3& a = points[random.below(points.size())];
        const Point3& b = points[random.below(points.size())];
        value = distance(a, b);
        sum += value;
    }
    if (!(sum > 0.0)) return fail(ErrorCode::kAllPointsEqual, "all points are the same point");
    const double perBin =
        options.range * sum / static_cast<double>(options.pairs) / static_cast<double>(options.bins);
    Histogram histogram(options.bins, 0.0F);
    const float share = 1.0F / static_cast<float>(options.pairs);
    for (const double value : distances) {
        const double bin = std::min(value / perBin, static_cast<double>(options.bins - 1));
        histogram[static_cast<std::size_t>(bin)] += share;
    }
    return histogram;
}

}  // namespace shapedb::bench
