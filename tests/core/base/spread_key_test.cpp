// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/spread_key.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

// The cells of a plane across an axis share one of three indices of 21 bits.
TEST(SpreadKey, CellsOfAPlaneShareFewSlots) {
    constexpr std::uint64_t kSide = 256;
    constexpr std::size_t kSlots = 2 * kSide * kSide;
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<int> inSlot(kSlots, 0);
        for (std::uint64_t i = 0; i < kSide; ++i) {
            for (std::uint64_t j = 0; j < kSide; ++j) {
                const std::uint64_t x = axis == 0 ? 77 : i;
                const std::uint64_t y = axis == 1 ? 77 : axis == 0 ? i : j;
                const std::uint64_t z = axis == 2 ? 77 : j;
                ++inSlot[spreadKey(x << 42 | y << 21 | z) % kSlots];
            }
        }
        // Of 65536 keys at random in twice as many slots, the fullest has 6 or 7, and 39 % are taken.
        EXPECT_LE(*std::max_element(inSlot.begin(), inSlot.end()), 12) << "across axis " << axis;
        const auto taken = kSlots - static_cast<std::size_t>(std::count(inSlot.begin(), inSlot.end(), 0));
        EXPECT_GT(taken, kSlots * 3 / 10) << "across axis " << axis;
    }
}

TEST(SpreadKey, EveryBitOfTheKeyReachesTheSlot) {
    for (int bit = 0; bit < 64; ++bit) {
        std::set<std::uint64_t> slots;
        for (std::uint64_t key = 0; key < 64; ++key) {
            slots.insert((spreadKey(key) ^ spreadKey(key ^ std::uint64_t{1} << bit)) % 4096);
        }
        EXPECT_GT(slots.size(), 8u) << "bit " << bit;
    }
}

}  // namespace
}  // namespace shapedb
