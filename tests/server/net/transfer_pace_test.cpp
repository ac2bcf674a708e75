// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/transfer_pace.h"

#include <gtest/gtest.h>

namespace shapedb::net {
namespace {

using namespace std::chrono_literals;

const PaceLimits kLimits{10s, 100};

TEST(TransferPace, AllowsSilenceForAWhile) {
    EXPECT_EQ(paceOf(kLimits, 9'999ms, 9'999ms, 0), Pace::kGood);
    EXPECT_EQ(paceOf(kLimits, 10'000ms, 10'000ms, 1'000'000), Pace::kStalled);
    EXPECT_NE(reasonOf(Pace::kStalled, kLimits).find("10 seconds"), std::string::npos);
}

TEST(TransferPace, WantsBytesForLongWaiting) {
    // 20 seconds of waiting, of which 10 are free.
    EXPECT_EQ(paceOf(kLimits, 1s, 20s, 1'000), Pace::kGood);
    EXPECT_EQ(paceOf(kLimits, 1s, 20s, 999), Pace::kTooSlow);
    EXPECT_EQ(paceOf(PaceLimits{10s, 0}, 1s, 1'000'000s, 0), Pace::kGood) << "any rate";
    EXPECT_NE(reasonOf(Pace::kTooSlow, kLimits).find("100 bytes per second"), std::string::npos);
}

TEST(TransferPace, IsMeasuredWhileOneWaitsOnly) {
    PaceMeter meter;
    const PaceMeter::Clock::time_point start{};
    EXPECT_EQ(meter.pace(kLimits, start + 1h), Pace::kGood) << "nobody waits";
    meter.begin(start);
    meter.begin(start + 9s);  // goes on
    EXPECT_EQ(meter.pace(kLimits, start + 10s), Pace::kStalled);
    meter.end(start + 9s, 10);
    meter.begin(start + 1h);
    EXPECT_EQ(meter.pace(kLimits, start + 1h), Pace::kGood) << "the hour between was ours";
    EXPECT_EQ(meter.pace(kLimits, start + 1h + 2s), Pace::kTooSlow) << "11 s of waiting for 10 bytes";
}

}  // namespace
}  // namespace shapedb::net
