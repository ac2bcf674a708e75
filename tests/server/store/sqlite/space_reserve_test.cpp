// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/space_reserve.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/temporary_directory.h"

namespace shapedb::store {
namespace {

class SpaceReserveTest : public ::testing::Test {
  protected:
    /// Bytes on the disk.
    std::int64_t taken() const {
        struct stat status {};
        return ::stat(path_.c_str(), &status) == 0 ? std::int64_t{512} * status.st_blocks : -1;
    }
    testing::TemporaryDirectory directory_;
    std::string path_ = directory_.path() + "/reserve";
};

TEST_F(SpaceReserveTest, TakesAndGivesSpace) {
    SpaceReserve reserve(path_, 1 << 20);
    EXPECT_FALSE(reserve.release()) << "nothing to give";
    ASSERT_TRUE(reserve.hold());
    EXPECT_GE(taken(), 1 << 20);
    EXPECT_TRUE(reserve.hold()) << "once is enough";
    EXPECT_TRUE(reserve.release());
    EXPECT_EQ(taken(), 0);
    EXPECT_FALSE(reserve.release());
    EXPECT_TRUE(reserve.hold());
    EXPECT_GE(taken(), 1 << 20);
}

// That it tells a full disk: tests/attack/disk_test.py.
TEST_F(SpaceReserveTest, IsDoneWithoutWhereThereCanBeNone) {
    SpaceReserve reserve("/nowhere/reserve", 1 << 20);
    EXPECT_TRUE(reserve.hold());
    EXPECT_FALSE(reserve.release());
}

}  // namespace
}  // namespace shapedb::store
