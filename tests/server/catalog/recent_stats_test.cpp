// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/recent_stats.h"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace shapedb::catalog {
namespace {

struct Counter {
    Result<store::StoreStats> count() {
        std::this_thread::sleep_for(cost);
        if (fails) return fail(ErrorCode::kUnavailable, "no database");
        store::StoreStats stats;
        stats.shapesReady = ++counts;
        return stats;
    }
    std::chrono::milliseconds cost{0};
    bool fails = false;
    std::uint64_t counts = 0;
};

TEST(RecentStats, WhatTakesLongIsNotCountedForEachLook) {
    Counter counter;
    counter.cost = std::chrono::milliseconds(200);  // known for 4 s
    RecentStats recent([&] { return counter.count(); });
    EXPECT_EQ(recent.get()->shapesReady, 1u);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(recent.get()->shapesReady, 1u);
}

TEST(RecentStats, AreCountedAgainWhenThatIsCheap) {
    Counter counter;
    counter.cost = std::chrono::milliseconds(1);
    RecentStats recent([&] { return counter.count(); });
    EXPECT_EQ(recent.get()->shapesReady, 1u);
    while (recent.get()->shapesReady == 1u) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(counter.counts, 2u);
}

TEST(RecentStats, AFailureIsTriedAgainAtOnce) {
    Counter counter;
    counter.cost = std::chrono::milliseconds(200);
    counter.fails = true;
    RecentStats recent([&] { return counter.count(); });
    ASSERT_FALSE(recent.get());
    counter.fails = false;
    EXPECT_EQ(recent.get()->shapesReady, 1u);
}

}  // namespace
}  // namespace shapedb::catalog
