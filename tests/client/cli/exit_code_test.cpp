// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/exit_code.h"

#include <set>

#include <gtest/gtest.h>

namespace shapedb::cli {
namespace {

TEST(ExitCode, EachKindOfFailureHasItsOwnCode) {
    EXPECT_EQ(exitCodeOf(ErrorCode::kInvalidArgument), 2);
    EXPECT_EQ(exitCodeOf(ErrorCode::kMalformedFilter), 2);
    EXPECT_EQ(exitCodeOf(ErrorCode::kCoplanar), 3);
    EXPECT_EQ(exitCodeOf(ErrorCode::kMalformedFile), 3);
    EXPECT_EQ(exitCodeOf(ErrorCode::kFileNotWritable), 3);
    EXPECT_EQ(exitCodeOf(ErrorCode::kNotFound), 4);
    EXPECT_EQ(exitCodeOf(ErrorCode::kVersionConflict), 4);
    EXPECT_EQ(exitCodeOf(ErrorCode::kUnavailable), 5);
    EXPECT_EQ(exitCodeOf(ErrorCode::kQueueFull), 5);
    EXPECT_EQ(exitCodeOf(ErrorCode::kStorageFull), 6);
    EXPECT_EQ(exitCodeOf(ErrorCode::kInternal), 6);
    EXPECT_EQ(exitCodeOf(ErrorCode::kCancelled), 130);
}

TEST(ExitCode, NoErrorMapsToSuccessOrSomeFailed) {
    const std::set<int> allowed = {2, 3, 4, 5, 6, 130};
    for (int i = 0; i <= static_cast<int>(ErrorCode::kInternal); ++i) {
        const auto code = static_cast<ErrorCode>(i);
        EXPECT_TRUE(allowed.count(exitCodeOf(code)) == 1) << errorCodeName(code);
    }
}

}  // namespace
}  // namespace shapedb::cli
