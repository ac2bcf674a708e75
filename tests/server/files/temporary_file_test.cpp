// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/files/temporary_file.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace shapedb::files {
namespace {

TEST(FreeSpace, IsAskedBeforeItIsFilled) {
    const testing::TemporaryDirectory directory;
    EXPECT_TRUE(requireFreeSpace(directory.path(), 0, "nothing"));
    const auto refused = requireFreeSpace(directory.path(), std::uint64_t{1} << 60, "the backup");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kStorageFull);
    EXPECT_EQ(refused.error().message.rfind("the backup needs 1152921504606846976 bytes of disk, ", 0), 0u)
        << refused.error().message;
    EXPECT_FALSE(requireFreeSpace(directory.path(), ~std::uint64_t{0}, "the backup"));
}

}  // namespace
}  // namespace shapedb::files
