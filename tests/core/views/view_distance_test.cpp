// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/view_distance.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

ViewSignature randomView(Random& random) {
    ViewSignature view;
    for (std::size_t bin = 0; bin < kViewBins; ++bin) {
        view.setLevel(bin, static_cast<std::uint8_t>(random.below(3) == 0 ? random.below(16) : 0));
    }
    view.size = static_cast<float>(random.uniform(0.5, 2.0));
    return view;
}

// The slow twin: bin by bin.
std::uint32_t plainDistance(const ViewSignature& query, const ViewSignature& view,
                            const ViewOptions& options) {
    std::uint32_t least = UINT32_MAX;
    for (int columns = 0; columns < 2; ++columns) {
        for (int rows = 0; rows < 2; ++rows) {
            for (int layers = 0; layers < 2; ++layers) {
                if (options.sideKnown && layers == 1) continue;
                if (!options.reflection && (columns + rows + layers) % 2 != 0) continue;
                const ViewSignature turn = flipped(query, {columns == 1, rows == 1, layers == 1});
                std::uint32_t sum = 0;
                for (std::size_t bin = 0; bin < kViewBins; ++bin) {
                    const int gap = std::abs(turn.level(bin) - view.level(bin));
                    sum += static_cast<std::uint32_t>(gap) * (bin < kViewCells ? 1 : kDistanceWeight);
                }
                least = std::min(least, sum);
            }
        }
    }
    if (!options.keepScale) return least;
    const double octaves = std::abs(std::log2(double{query.size}) - std::log2(double{view.size}));
    return least + static_cast<std::uint32_t>(std::min<double>(kMostForSize, kSizeWeight * octaves));
}

ViewOptions optionsOf(unsigned bits) { return {(bits & 1u) != 0, (bits & 2u) != 0, (bits & 4u) != 0}; }

TEST(ViewDistance, EqualsTheSumBinByBin) {
    Random random(1);
    for (int i = 0; i < 300; ++i) {
        const ViewSignature query = randomView(random);
        const ViewSignature view = randomView(random);
        const ViewOptions options = optionsOf(static_cast<unsigned>(i));
        EXPECT_EQ(ViewQuery(query, options).distance(view), plainDistance(query, view, options));
    }
}

TEST(ViewDistance, IsNeverBelowItsBound) {
    Random random(2);
    for (int i = 0; i < 3000; ++i) {
        const ViewSignature query = randomView(random);
        ViewSignature view = i % 2 == 0 ? randomView(random) : query;
        for (std::size_t changes = random.below(20); changes > 0; --changes) {
            view.setLevel(random.below(kViewBins), static_cast<std::uint8_t>(random.below(16)));
        }
        const ViewQuery prepared(query, optionsOf(static_cast<unsigned>(i)));
        EXPECT_LE(prepared.bound(coarseView(view)), prepared.distance(view));
    }
}

TEST(ViewDistance, OfExtremeLevelsIsBounded) {
    ViewSignature full;
    full.levels.fill(0xff);
    full.size = 1.0f;
    const ViewQuery query(full);
    EXPECT_EQ(query.distance(ViewSignature{}), 15u * (kViewCells + kDistanceWeight * kViewDistances));
    EXPECT_EQ(query.bound(coarseView(ViewSignature{})), query.distance(ViewSignature{}));
    EXPECT_EQ(query.distance(full), 0u);
}

TEST(ViewDistance, IsTheLeastOverTheViewsOfAShape) {
    Random random(3);
    ViewSet set;
    for (ViewSignature& view : set.views) view = randomView(random);
    const ViewQuery query(randomView(random));
    std::uint32_t least = UINT32_MAX;
    for (const ViewSignature& view : set.views) least = std::min(least, query.distance(view));
    EXPECT_EQ(query.distance(set), least);
    EXPECT_EQ(ViewQuery(set.views[7]).distance(set), 0u);
}

TEST(ViewDistance, CountsFlipsOnlyWhereTheyAreAllowed) {
    Random random(4);
    const ViewSignature view = randomView(random);
    const ViewSignature mirrored = flipped(view, {true, false, false});
    const ViewSignature turned = flipped(view, {true, true, false});
    const ViewSignature behind = flipped(view, {true, false, true});
    ViewOptions options;
    EXPECT_EQ(ViewQuery(view, options).distance(mirrored), 0u);
    options.reflection = false;
    EXPECT_GT(ViewQuery(view, options).distance(mirrored), 0u);
    EXPECT_EQ(ViewQuery(view, options).distance(turned), 0u);
    EXPECT_EQ(ViewQuery(view, options).distance(behind), 0u);
    options.sideKnown = true;
    EXPECT_GT(ViewQuery(view, options).distance(behind), 0u);
}

TEST(ViewDistance, CountsSizesIfTheScaleIsKept) {
    Random random(5);
    const ViewSignature view = randomView(random);
    ViewSignature larger = view;
    larger.size = 2.0f * view.size;
    EXPECT_EQ(ViewQuery(view).distance(larger), 0u);
    ViewOptions options;
    options.keepScale = true;
    EXPECT_NEAR(ViewQuery(view, options).distance(larger), kSizeWeight, 1.0);
    larger.size = 1e6f * view.size;
    EXPECT_EQ(ViewQuery(view, options).distance(larger), kMostForSize);
}

}  // namespace
}  // namespace shapedb
