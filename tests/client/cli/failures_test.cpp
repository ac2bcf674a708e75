// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/failures.h"

#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "client/cli/console.h"

namespace shapedb::cli {

namespace {

std::string told(const Failures& failures, std::size_t all) {
    std::ostringstream out;
    std::ostringstream err;
    Console console(out, err, {});
    failures.tell(console, all, "file", "files");
    return err.str();
}

TEST(Failures, OneReasonIsToldOnce) {
    Failures failures;
    for (int i = 0; i < 190; ++i) {
        failures.add(std::to_string(i) + ".ply", {ErrorCode::kNotFound, "there is no collection 'x'"});
    }
    failures.add("bad.ply", {ErrorCode::kMalformedFile, "bad.ply: line 3: no number"});
    EXPECT_EQ(told(failures, 200),
              "shapedb: 0.ply: there is no collection 'x'; the same of 189 others\n"
              "shapedb: bad.ply: line 3: no number\n"
              "shapedb: 191 of 200 files failed\n");
    EXPECT_EQ(failures.exitCode(200), kSomeFailed);
}

TEST(Failures, OfOneItemHaveItsExitCode) {
    Failures failures;
    EXPECT_EQ(failures.exitCode(3), kOk);
    EXPECT_EQ(told(failures, 3), "");
    failures.add("a", {ErrorCode::kMalformedFile, "broken"});
    EXPECT_EQ(failures.exitCode(1), kBadData);
    EXPECT_EQ(failures.exitCode(2), kSomeFailed);
    EXPECT_EQ(told(failures, 1), "shapedb: a: broken\n") << "no summary of one";
    failures.add("b", {ErrorCode::kCancelled, "cancelled"});
    EXPECT_EQ(failures.exitCode(9), kInterrupted);
}

TEST(Failures, WhatWouldFailForAllEndsTheCommand) {
    for (const ErrorCode code : {ErrorCode::kUnavailable, ErrorCode::kCancelled, ErrorCode::kDeadlineExceeded,
                                 ErrorCode::kPermissionDenied, ErrorCode::kUnauthenticated}) {
        EXPECT_TRUE(endsTheCommand({code, ""})) << errorCodeName(code);
    }
    EXPECT_FALSE(endsTheCommand({ErrorCode::kMalformedFile, ""}));
    EXPECT_FALSE(endsTheCommand({ErrorCode::kNotFound, ""}));
}

}  // namespace

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
