// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/call.h"

#include <gtest/gtest.h>

namespace shapedb::rpc {
namespace {

const std::string kTrace = "4bf92f3577b34da6a3ce929d0e0e4736";
const std::string kParent = "00f067aa0ba902b7";

std::string written(const std::string& version, const std::string& trace = kTrace,
                    const std::string& parent = kParent, const std::string& flags = "01",
                    const std::string& rest = "") {
    return version + "-" + trace + "-" + parent + "-" + flags + rest;
}

TEST(TraceParent, OfVersion00EndsAfterTheFlags) {
    EXPECT_EQ(traceIdOf(written("00")), kTrace);
    EXPECT_EQ(traceIdOf(written("00", kTrace, kParent, "ff")), kTrace) << "flags are not ours to judge";
    for (const std::string rest : {"-", "-x", "-01", "x", "1", " "}) {
        EXPECT_FALSE(traceIdOf(written("00", kTrace, kParent, "01", rest))) << rest;
    }
}

TEST(TraceParent, OfLaterVersionsMayGoOnAfterADash) {
    for (const std::string version : {"01", "cc", "fe"}) {
        EXPECT_EQ(traceIdOf(written(version)), kTrace);
        EXPECT_EQ(traceIdOf(written(version, kTrace, kParent, "01", "-what-comes")), kTrace);
        EXPECT_EQ(traceIdOf(written(version, kTrace, kParent, "01", "-")), kTrace);
        EXPECT_FALSE(traceIdOf(written(version, kTrace, kParent, "01", "x")));
    }
    EXPECT_FALSE(traceIdOf(written("ff")));
}

TEST(TraceParent, HasLowerCaseDigitsThatAreNotAllZero) {
    EXPECT_FALSE(traceIdOf(""));
    EXPECT_FALSE(traceIdOf("nonsense"));
    EXPECT_FALSE(traceIdOf(written("00", std::string(32, '0'))));
    EXPECT_FALSE(traceIdOf(written("00", kTrace, std::string(16, '0'))));
    const std::string good = written("00");
    for (std::size_t i = 0; i < good.size(); ++i) {
        for (const char wrong : {'g', 'A', '-', ' ', '\0'}) {
            std::string bad = good;
            if (bad[i] == wrong) continue;
            bad[i] = wrong;
            EXPECT_FALSE(traceIdOf(bad)) << bad;
        }
        EXPECT_FALSE(traceIdOf(good.substr(0, i))) << i;
    }
}

}  // namespace
}  // namespace shapedb::rpc
