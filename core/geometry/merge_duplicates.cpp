// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/merge_duplicates.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/large_block.h"
#include "core/base/processor.h"
#include "core/geometry/box.h"

namespace shapedb {

namespace {

struct Placed {
    Point3 at;
    std::uint32_t index = 0;
};
using PlacedPoints = LargeVector<Placed>;  // given back to the system at once

// By coordinates, equal points by index. A bucket sort into slices along x, as many as there are points,
// then a sort of each slice.
PlacedPoints lexicographicallySorted(const PointCloud& points) {
    PlacedPoints sorted(points.size());
    if (points.empty()) return sorted;
    const Box box = boxOf(points);
    const double extent = box.high.x - box.low.x;
    const auto slices = static_cast<double>(points.size());
    const double perUnit = extent > 0.0 && std::isfinite(slices / extent) ? slices / extent : 0.0;
    const auto sliceOf = [&](const Point3& p) {
        return static_cast<std::size_t>(std::min(slices - 1.0, (p.x - box.low.x) * perUnit));
    };
    std::vector<std::uint32_t> begin(points.size() + 1, 0);
    for (const Point3& p : points) ++begin[sliceOf(p) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    // Points scatter all over memory, so the places they go to are prefetched.
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (i + kPrefetchFarDistance < points.size())
            prefetch(&begin[sliceOf(points[i + kPrefetchFarDistance])]);
        if (i + kPrefetchDistance < points.size())
            prefetch(sorted.data() + begin[sliceOf(points[i + kPrefetchDistance])]);
        sorted[begin[sliceOf(points[i])]++] = {points[i], i};
    }
    std::size_t from = 0;
    for (std::size_t slice = 0; slice < points.size(); ++slice) {
        const std::size_t to = begin[slice];  // filling the slice moved this to its end
        if (to - from > 1) {
            std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(from),
                      sorted.begin() + static_cast<std::ptrdiff_t>(to), [](const Placed& a, const Placed& b) {
                          if (a.at != b.at) return lexicographicLess(a.at, b.at);
                          return a.index < b.index;
                      });
        }
        from = to;
    }
    return sorted;
}

}  // namespace

MergedPoints mergeDuplicates(const PointCloud& points) {
    const PlacedPoints sorted = lexicographicallySorted(points);
    MergedPoints merged;
    merged.points.reserve(points.size());
    merged.siteOfPoint.resize(points.size());
    for (const Placed& p : sorted) {
        if (merged.points.empty() || merged.points.back() != p.at) merged.points.push_back(p.at);
        merged.siteOfPoint[p.index] = static_cast<std::uint32_t>(merged.points.size() - 1);
    }
    return merged;
}

}  // namespace shapedb
