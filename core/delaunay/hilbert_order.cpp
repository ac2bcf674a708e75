// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/hilbert_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/parallel.h"
#include "core/base/radix_sort.h"
#include "core/geometry/box.h"
#include "core/geometry/morton.h"

namespace shapedb {

namespace {

constexpr std::uint32_t kBits = 21;
constexpr std::size_t kPointsPerBlock = 4096;  // points that a thread handles at a time

// Skilling, "Programming the Hilbert curve" (2004): turns the coordinates into the transposed index, in
// place; interleaving its bits gives the index.
std::uint64_t hilbertIndex(std::array<std::uint32_t, 3> x) {
    for (std::uint32_t q = 1u << (kBits - 1); q > 1; q >>= 1) {
        const std::uint32_t below = q - 1;
        for (std::uint32_t& axis : x) {
            // Bit set: invert the low bits of the first axis. Not set: swap them with those of this axis.
            // Branch-free, because the bits are random.
            const std::uint32_t set = (axis & q) != 0 ? ~0u : 0u;
            const std::uint32_t swap = (x[0] ^ axis) & below & ~set;
            x[0] ^= swap | (below & set);
            axis ^= swap;
        }
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    std::uint32_t flip = 0;
    for (std::uint32_t q = 1u << (kBits - 1); q > 1; q >>= 1) {
        if ((x[2] & q) != 0) flip ^= q - 1;
    }
    for (std::uint32_t& axis : x) axis ^= flip;
    return spreadBits3(x[0]) << 2 | spreadBits3(x[1]) << 1 | spreadBits3(x[2]);
}

LargeVector<KeyedIndex> keysOf(const PointCloud& points) {
    const Box box = boxOf(points);
    const double extent = std::max({box.extent().x, box.extent().y, box.extent().z});
    const double last = (1u << kBits) - 1;
    // The extent of finite points may overflow. Then all of them lie in one step, in the order of their
    // indices.
    const double steps = extent > 0.0 && std::isfinite(extent) ? last / extent : 0.0;
    // Rounding may take the farthest point a step too far.
    const auto step = [=](double v) { return static_cast<std::uint32_t>(std::min(last, v * steps)); };
    LargeVector<KeyedIndex> keyed(points.size());
    // Cannot fail: the default context never cancels.
    static_cast<void>(parallelFor(points.size(), kPointsPerBlock, {}, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
            const Point3 p = points[i] - box.low;
            keyed[i] = {hilbertIndex({step(p.x), step(p.y), step(p.z)}), static_cast<std::uint32_t>(i)};
        }
    }));
    return keyed;
}

}  // namespace

std::vector<std::uint32_t> hilbertOrder(const PointCloud& points) {
    if (points.empty()) return {};
    LargeVector<KeyedIndex> keyed = keysOf(points);
    radixSortByKey(keyed);
    std::vector<std::uint32_t> order(points.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = keyed[i].index;
    return order;
}

HilbertSortedCloud::HilbertSortedCloud(const PointCloud& unsorted) : order_(hilbertOrder(unsorted)) {
    points_.reserve(unsorted.size());
    for (const std::uint32_t i : order_) points_.push_back(unsorted[i]);
}

}  // namespace shapedb
