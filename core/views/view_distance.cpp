// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/view_distance.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace shapedb {

namespace {

constexpr std::size_t kCellBytes = kViewCells / 2;

// The compiler turns this into sums of absolute differences of 16 bytes at a time.
std::uint32_t differences(const std::uint8_t* a, const std::uint8_t* b, std::size_t count) {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
        sum += static_cast<std::uint32_t>(std::abs(static_cast<int>(a[i]) - static_cast<int>(b[i])));
    }
    return sum;
}

// Of an even number of flips and, where the side is known, none of the layers.
bool isAllowed(const Flip& flip, const ViewOptions& options) {
    if (options.sideKnown && flip.layers) return false;
    const int flips =
        static_cast<int>(flip.columns) + static_cast<int>(flip.rows) + static_cast<int>(flip.layers);
    return options.reflection || flips % 2 == 0;
}

double octavesOf(float size) { return size > 0.0f ? std::log2(static_cast<double>(size)) : 0.0; }

}  // namespace

CoarseView coarseView(const ViewSignature& view) {
    CoarseView coarse;
    for (std::size_t x = 0; x < kViewColumns; ++x) {
        for (std::size_t y = 0; y < kViewRows; ++y) {
            const std::size_t ring =
                std::min(x, kViewColumns - 1 - x) * ((kViewRows + 1) / 2) + std::min(y, kViewRows - 1 - y);
            for (std::size_t z = 0; z < kViewLayers; ++z) {
                coarse.rings[ring] = static_cast<std::uint8_t>(
                    coarse.rings[ring] + view.level((x * kViewRows + y) * kViewLayers + z));
            }
        }
    }
    std::copy(view.levels.begin() + kCellBytes, view.levels.end(), coarse.distances.begin());
    return coarse;
}

ShapeViews::ShapeViews(const ViewSet& views) : set(views) {
    std::transform(views.views.begin(), views.views.end(), coarse.begin(), coarseView);
}

ViewQuery::ViewQuery(const ViewSignature& view, const ViewOptions& options)
    : coarse_(coarseView(view)), octaves_(octavesOf(view.size)), keepScale_(options.keepScale) {
    for (unsigned i = 0; i < 8; ++i) {
        const Flip flip{(i & 1u) != 0, (i & 2u) != 0, (i & 4u) != 0};
        if (!isAllowed(flip, options)) continue;
        const ViewSignature turn = flipped(view, flip);
        Unpacked levels{};
        for (std::size_t k = 0; k < kViewBytes; ++k) {
            levels[k] = turn.level(2 * k);
            levels[kViewBytes + k] = turn.level(2 * k + 1);
        }
        turns_.push_back(levels);
    }
}

std::uint32_t ViewQuery::distance(const ViewSignature& view) const {
    Unpacked levels;
    for (std::size_t k = 0; k < kViewBytes; ++k) {
        levels[k] = view.levels[k] & 15u;
        levels[kViewBytes + k] = static_cast<std::uint8_t>(view.levels[k] >> 4u);
    }
    std::uint32_t least = UINT32_MAX;
    for (const Unpacked& turn : turns_) {
        least = std::min(least, differences(turn.data(), levels.data(), levels.size()));
    }
    // No flip moves the distances: what they weigh more is the same for all.
    const std::uint8_t* own = turns_.front().data();
    const std::uint32_t ofDistances =
        differences(own + kCellBytes, levels.data() + kCellBytes, kViewDistances / 2) +
        differences(own + kViewBytes + kCellBytes, levels.data() + kViewBytes + kCellBytes,
                    kViewDistances / 2);
    least += (kDistanceWeight - 1) * ofDistances;
    if (keepScale_) {
        const double octaves = std::abs(octaves_ - octavesOf(view.size));
        least += static_cast<std::uint32_t>(std::min<double>(kMostForSize, kSizeWeight * octaves));
    }
    return least;
}

std::uint32_t ViewQuery::bound(const CoarseView& coarse) const {
    std::uint32_t sum = differences(coarse_.rings.data(), coarse.rings.data(), kCoarseRings);
    for (std::size_t k = 0; k < coarse.distances.size(); ++k) {
        const int low = (coarse_.distances[k] & 15) - (coarse.distances[k] & 15);
        const int high = (coarse_.distances[k] >> 4) - (coarse.distances[k] >> 4);
        sum += kDistanceWeight * static_cast<std::uint32_t>(std::abs(low) + std::abs(high));
    }
    return sum;
}

std::uint32_t ViewQuery::distance(const ViewSet& set) const {
    std::uint32_t least = UINT32_MAX;
    for (const ViewSignature& view : set.views) least = std::min(least, distance(view));
    return least;
}

std::uint32_t ViewQuery::distance(const ShapeViews& shape, std::uint32_t most) const {
    std::uint32_t least = UINT32_MAX;
    for (std::size_t i = 0; i < kViews; ++i) {
        if (bound(shape.coarse[i]) > most) continue;
        least = std::min(least, distance(shape.set.views[i]));
        most = std::min(most, least);
    }
    return least;
}

}  // namespace shapedb
