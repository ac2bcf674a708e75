// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/large_block.h"

#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(LargeBlock, KeepsWhatIsWrittenAndThrowsWhenOutOfMemory) {
    for (const std::size_t count :
         {std::size_t{1}, std::size_t{1000}, std::size_t{300000}, std::size_t{20000000}}) {
        const auto block = allocateLarge<std::uint32_t>(count);
        for (std::size_t i = 0; i < count; ++i) block[i] = static_cast<std::uint32_t>(i);
        EXPECT_EQ(block[count - 1], count - 1);
    }
    EXPECT_THROW(static_cast<void>(allocateLarge<double>(std::size_t{1} << 58)), std::bad_alloc);
}

// Sizes around the limits from which blocks are mapped and use huge pages; vectors of odd sizes.
TEST(LargeBlock, RecycledPagesServeVectorsOfAnySize) {
    for (const std::size_t megabytes : {0, 1, 3, 8, 9, 31, 64}) {
        auto block = allocateLarge<std::uint64_t>(megabytes * 131072 + 11);
        block[0] = 1;
        PageRecycler recycler(std::move(block));
        std::vector<LargeVector<std::uint32_t>> vectors;
        for (const std::size_t count : {5, 300000, 2200000, 4500001, 2500000, 9000000}) {
            vectors.push_back(recycler.makeVector<std::uint32_t>(count));
            ASSERT_EQ(vectors.back().size(), count);
            for (std::size_t i = 0; i < count; ++i) vectors.back()[i] = static_cast<std::uint32_t>(i ^ count);
        }
        for (const auto& vector : vectors) {
            std::size_t wrong = 0;
            for (std::size_t i = 0; i < vector.size(); ++i) {
                if (vector[i] != static_cast<std::uint32_t>(i ^ vector.size())) ++wrong;
            }
            EXPECT_EQ(wrong, 0U) << megabytes << " " << vector.size();
        }
        vectors.front().resize(10000000);  // still an ordinary vector
        EXPECT_EQ(vectors.front()[4], 4U ^ 5U);
    }
}

}  // namespace
}  // namespace shapedb
