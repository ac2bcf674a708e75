// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/api/convert.h"

#include <limits>

#include <gtest/gtest.h>

#include "client/cli/text.h"

namespace shapedb::client {
namespace {

std::string shown(std::int64_t seconds, std::int32_t nanos = 0) {
    google::protobuf::Timestamp time;
    time.set_seconds(seconds);
    time.set_nanos(nanos);
    return cli::timeText(fromWire(time));
}

// The clock's own type, in nanoseconds, ends in 2262 and would begin again in 1677.
TEST(Timestamps, AreThoseThatTheServerSent) {
    EXPECT_EQ(shown(0), "1970-01-01T00:00:00Z");
    EXPECT_EQ(shown(9'223'372'037), "2262-04-11T23:47:17Z");
    EXPECT_EQ(shown(253'402'300'799, 999'999'999), "9999-12-31T23:59:59Z");
    EXPECT_EQ(shown(-62'135'596'800), "1-01-01T00:00:00Z");
    EXPECT_EQ(shown(-1, 999'000'000), "1969-12-31T23:59:59Z");
}

TEST(Timestamps, BeyondAllCalendarsStayOnTheirSide) {
    constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
    for (const std::int64_t far : {kEnd, kEnd / 2, std::int64_t{1} << 45}) {
        google::protobuf::Timestamp time;
        time.set_seconds(far);
        EXPECT_GT(fromWire(time), currentTime()) << far;
        time.set_seconds(-far);
        EXPECT_LT(fromWire(time), Timestamp()) << far;
    }
}

TEST(Timestamps, GoBackAsTheyCame) {
    for (const std::int64_t seconds : {std::int64_t{-3}, std::int64_t{0}, std::int64_t{253'402'300'799}}) {
        google::protobuf::Timestamp time;
        time.set_seconds(seconds);
        time.set_nanos(123'456'000);
        const auto back = toWire(fromWire(time));
        EXPECT_EQ(back.seconds(), seconds);
        EXPECT_EQ(back.nanos(), 123'456'000);
    }
}

}  // namespace
}  // namespace shapedb::client
