// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/radix_sort.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

void expectStablySorted(LargeVector<KeyedIndex> keyed) {
    LargeVector<KeyedIndex> expected = keyed;
    std::stable_sort(expected.begin(), expected.end(),
                     [](const KeyedIndex& a, const KeyedIndex& b) { return a.key < b.key; });
    radixSortByKey(keyed);
    ASSERT_EQ(keyed.size(), expected.size());
    for (std::size_t i = 0; i < keyed.size(); ++i) {
        ASSERT_EQ(keyed[i].key, expected[i].key) << i;
        ASSERT_EQ(keyed[i].index, expected[i].index) << i;
    }
}

LargeVector<KeyedIndex> randomKeys(std::size_t count, std::uint64_t mask, std::uint64_t seed) {
    Random random(seed);
    LargeVector<KeyedIndex> keyed;
    for (std::uint32_t i = 0; i < count; ++i) keyed.push_back({random.below(~std::uint64_t{0}) & mask, i});
    return keyed;
}

TEST(RadixSort, IsStable) {
    expectStablySorted({});
    expectStablySorted({{7, 0}});
    for (const std::size_t count : {2U, 100U, 5000U}) {
        expectStablySorted(randomKeys(count, ~std::uint64_t{0}, count));
    }
}

// Digits in which all keys agree are skipped: the lowest, the highest, some between, all of them.
TEST(RadixSort, SkipsDigitsInWhichAllKeysAgree) {
    for (const std::uint64_t mask : {std::uint64_t{0}, std::uint64_t{0x7ff}, std::uint64_t{3} << 62,
                                     std::uint64_t{0xff0000000000ff}, std::uint64_t{0xff} << 20}) {
        expectStablySorted(randomKeys(3000, mask, mask + 1));
    }
}

TEST(RadixSort, IsStableOnAnyNumberOfThreads) {
    for (const int threads : {1, 2, 3, 5}) {
        tbb::task_arena arena(threads);
        arena.execute([] { expectStablySorted(randomKeys(400001, std::uint64_t{0xff} << 40 | 0xf, 2)); });
    }
}

TEST(RadixSort, SortsPlainNumbers) {
    Random random(4);
    for (const std::size_t count : {0U, 1U, 2U, 3000U}) {
        LargeVector<std::uint32_t> numbers;
        for (std::size_t i = 0; i < count; ++i) {
            numbers.push_back(static_cast<std::uint32_t>(random.below(std::uint64_t{1} << 32)));
        }
        LargeVector<std::uint32_t> expected = numbers;
        std::sort(expected.begin(), expected.end());
        radixSortNumbers(numbers);
        EXPECT_EQ(numbers, expected);
    }
}

}  // namespace
}  // namespace shapedb
