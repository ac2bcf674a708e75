// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/disjoint_sets.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

TEST(DisjointSets, StartAsSingletons) {
    DisjointSets sets(3);
    EXPECT_EQ(sets.size(), 3U);
    for (std::uint32_t i = 0; i < 3; ++i) {
        EXPECT_EQ(sets.find(i), i);
        EXPECT_TRUE(sets.isRepresentative(i));
    }
}

TEST(DisjointSets, UnionKeepsTheSmallestMemberAsRepresentative) {
    DisjointSets sets(6);
    sets.unite(5, 4);
    sets.unite(4, 2);
    sets.unite(3, 5);
    for (const std::uint32_t i : {2U, 3U, 4U, 5U}) EXPECT_EQ(sets.find(i), 2U) << i;
    EXPECT_EQ(sets.find(0), 0U);
    EXPECT_EQ(sets.find(1), 1U);
    EXPECT_FALSE(sets.isRepresentative(5));
}

TEST(DisjointSets, UniteOfOneSetChangesNothing) {
    DisjointSets sets(3);
    sets.unite(1, 2);
    sets.unite(2, 1);
    sets.unite(1, 1);
    EXPECT_EQ(sets.find(2), 1U);
    EXPECT_TRUE(sets.isRepresentative(1));
}

TEST(DisjointSets, AbsorbKeepsTheRepresentativeItIsGiven) {
    DisjointSets sets(4);
    sets.absorb(3, 0);
    sets.absorb(2, 3);
    for (const std::uint32_t i : {0U, 2U, 3U}) EXPECT_EQ(sets.find(i), 2U) << i;
    EXPECT_EQ(sets.find(1), 1U);
}

TEST(DisjointSets, AgreesWithRelabellingUnderRandomUnions) {
    constexpr std::uint32_t kCount = 200;
    Random random(7);
    DisjointSets sets(kCount);
    std::vector<std::uint32_t> smallest(kCount);  // of the set of each
    for (std::uint32_t i = 0; i < kCount; ++i) smallest[i] = i;
    for (int step = 0; step < 180; ++step) {
        const auto a = static_cast<std::uint32_t>(random.below(kCount));
        const auto b = static_cast<std::uint32_t>(random.below(kCount));
        sets.unite(a, b);
        const std::uint32_t low = std::min(smallest[a], smallest[b]);
        const std::uint32_t high = std::max(smallest[a], smallest[b]);
        for (std::uint32_t& s : smallest) {
            if (s == high) s = low;
        }
        for (std::uint32_t i = 0; i < kCount; ++i) ASSERT_EQ(sets.find(i), smallest[i]) << step << " " << i;
    }
}

}  // namespace
}  // namespace shapedb
