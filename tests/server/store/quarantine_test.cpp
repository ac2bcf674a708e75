// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/quarantine.h"

#include <gtest/gtest.h>

namespace shapedb::store {
namespace {

TEST(Quarantine, BeginsAfterAsManyCrashesAsAllowed) {
    EXPECT_FALSE(isQuarantined({0, 0}, 1));
    EXPECT_FALSE(isQuarantined({1, 0}, 2));
    EXPECT_TRUE(isQuarantined({2, 0}, 2));
    EXPECT_TRUE(isQuarantined({3, 0}, 2)) << "the limit was lowered";
    EXPECT_TRUE(isQuarantined({1, 0}, 1));
}

TEST(Quarantine, KillsAreNoProofUntilTheyAreMany) {
    EXPECT_FALSE(isQuarantined({0, 5}, 1));
    EXPECT_FALSE(isQuarantined({0, kMostStops - 1}, 1));
    EXPECT_TRUE(isQuarantined({0, kMostStops}, 1));
    EXPECT_FALSE(isSuspect({0, 0}));
    EXPECT_TRUE(isSuspect({0, 1})) << "segmented alone";
    EXPECT_TRUE(isSuspect({1, 0}));
}

TEST(Quarantine, SaysWhatHappenedAndWhatToDo) {
    const Error crashed = quarantineError({2, 1});
    EXPECT_EQ(crashed.code, ErrorCode::kInternal);
    EXPECT_NE(crashed.message.find("crashed the server 2 times"), std::string::npos) << crashed.message;
    EXPECT_NE(crashed.message.find("Send it again"), std::string::npos) << crashed.message;
    const Error ended = quarantineError({0, 20});
    EXPECT_NE(ended.message.find("ended 20 times"), std::string::npos) << ended.message;
}

}  // namespace
}  // namespace shapedb::store
