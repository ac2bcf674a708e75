#include "core/base/large_block.h"

#include <cstdint>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(LargeBlock, HoldsWhatIsWritten) {
    for (const std::size_t count :
         {std::size_t{1}, std::size_t{1000}, std::size_t{300000}, std::size_t{20000000}}) {
        const auto block = allocateLarge<std::uint32_t>(count);
        for (std::size_t i = 0; i < count; ++i) block[i] = static_cast<std::uint32_t>(i);
        EXPECT_EQ(block[count - 1], count - 1);
    }
    EXPECT_THROW(static_cast<void>(allocateLarge<double>(std::size_t{1} << 58)), std::bad_alloc);
}

}  // namespace
}  // namespace shapedb
