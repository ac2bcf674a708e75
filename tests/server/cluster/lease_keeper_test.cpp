// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/lease_keeper.h"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/cluster/assignment.h"
#include "tests/server/cluster/simulated_database.h"

namespace shapedb::cluster {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kTerm{1'000};

/// Servers that talk to one table without delay.
struct LeaseKeeping : ::testing::Test {
    sim::Database table{1};

    LeaseKeeper server(const std::string& name) {
        LeaseKeeper keeper({name, 1, kTerm});
        keeper.setLoaded(ShardSet().set());
        return keeper;
    }
    void beat(LeaseKeeper& keeper) {
        const Instant sentAt(table.now);
        const auto view = table.beat(keeper.next(sentAt));
        ASSERT_TRUE(view);
        keeper.onView(sentAt, *view);
    }
    Instant now() const { return Instant(table.now); }
};

TEST_F(LeaseKeeping, TheOnlyServerHoldsAllShards) {
    LeaseKeeper one = server("a");
    beat(one);  // says that it is there
    EXPECT_TRUE(one.held(now()).none());
    beat(one);
    EXPECT_TRUE(one.held(now()).all());
    EXPECT_EQ(one.epoch(0, now()), 1);
}

TEST_F(LeaseKeeping, NothingIsTakenThatIsNotLoaded) {
    LeaseKeeper one({"a", 1, kTerm});
    one.setLoaded(ShardSet().set(3));
    beat(one);
    beat(one);
    EXPECT_EQ(one.held(now()), ShardSet().set(3));
    EXPECT_TRUE(one.wanted(now()).all());
}

TEST_F(LeaseKeeping, ALeaseEndsWithItsTermUnlessItIsRenewed) {
    LeaseKeeper one = server("a");
    beat(one);
    beat(one);
    table.now += 999;
    EXPECT_TRUE(one.held(now()).all());
    table.now += 1;
    EXPECT_TRUE(one.held(now()).none());
    table.now -= 500;
    beat(one);
    table.now += 999;
    EXPECT_TRUE(one.held(now()).all());
}

TEST_F(LeaseKeeping, ALeaseCountsFromBeforeItsBeatWasSent) {
    LeaseKeeper one = server("a");
    beat(one);
    const Instant sentAt = now();
    const Beat beatNow = one.next(sentAt);
    table.now += 300;
    const auto view = table.beat(beatNow);
    table.now += 300;
    one.onView(sentAt, *view);
    EXPECT_TRUE(one.held(sentAt + milliseconds(999)).all());
    EXPECT_TRUE(one.held(sentAt + milliseconds(1'000)).none());
}

TEST_F(LeaseKeeping, AnotherTakesOverWhatHasEndedWithTheNextEpoch) {
    LeaseKeeper one = server("a");
    beat(one);
    beat(one);
    LeaseKeeper two = server("b");
    table.now += 1'000;
    beat(two);
    beat(two);
    EXPECT_TRUE(two.held(now()).all());
    EXPECT_EQ(two.epoch(0, now()), 2);
}

TEST_F(LeaseKeeping, HalfIsHandedOverToASecondServer) {
    LeaseKeeper one = server("a");
    LeaseKeeper two = server("b");
    beat(one);
    beat(one);
    for (int i = 0; i < 4; ++i) {
        beat(two);
        beat(one);
        EXPECT_TRUE((one.held(now()) & two.held(now())).none());
    }
    beat(two);
    EXPECT_EQ(one.held(now()).count(), 128u);
    EXPECT_EQ(two.held(now()).count(), 128u);
    EXPECT_TRUE((one.held(now()) | two.held(now())).all());
}

TEST_F(LeaseKeeping, WhoLeavesKeepsServingUntilOthersHaveTakenOver) {
    LeaseKeeper one = server("a");
    beat(one);
    beat(one);
    LeaseKeeper two({"b", 1, kTerm});
    one.leave();
    beat(one);
    beat(two);
    EXPECT_TRUE(one.held(now()).all());
    two.setLoaded(ShardSet().set());
    beat(two);  // wants them
    beat(one);  // sees it
    beat(one);  // hands them over
    EXPECT_TRUE(one.held(now()).none());
    beat(two);
    EXPECT_TRUE(two.held(now()).all());
}

TEST_F(LeaseKeeping, WhatIsHandedOverIsNotUsedEvenIfTheTableDidNotHearOfIt) {
    LeaseKeeper one = server("a");
    beat(one);
    beat(one);
    LeaseKeeper two = server("b");
    one.leave();
    beat(one);
    beat(two);
    beat(two);  // wants them
    one.onView(now(), *table.view());
    ASSERT_EQ(one.next(now()).handOver.size(), 256u);  // lost on the way
    EXPECT_TRUE(one.held(now()).none());
    one.onView(now(), *table.view());
    EXPECT_TRUE(one.held(now()).none());
    EXPECT_EQ(one.next(now()).handOver.size(), 256u) << "said again";
}

TEST(AssignShards, SharesAreEvenAndReplicasDiffer) {
    for (const int replicas : {1, 2, 3}) {
        for (std::size_t count = 1; count <= 7; ++count) {
            std::vector<std::string> servers;
            for (std::size_t i = 0; i < count; ++i) servers.push_back("server-" + std::to_string(i));
            std::vector<std::size_t> load(count, 0);
            const auto assignment = assignShards(servers, replicas);
            ASSERT_EQ(assignment.size(), 256u);
            const std::size_t slots = std::min<std::size_t>(static_cast<std::size_t>(replicas), count);
            for (const auto& holders : assignment) {
                EXPECT_EQ(std::set<int>(holders.begin(), holders.end()).size(), slots);
                for (const int holder : holders) ++load[static_cast<std::size_t>(holder)];
            }
            for (const std::size_t has : load) {
                EXPECT_NEAR(static_cast<double>(has),
                            256.0 * static_cast<double>(slots) / static_cast<double>(count), 8.0)
                    << count << " servers, " << replicas << " replicas";
            }
        }
    }
}

TEST(AssignShards, FewShardsMoveWhenAServerComes) {
    const auto before = assignShards({"a", "b", "c"}, 1);
    const auto after = assignShards({"a", "b", "c", "d"}, 1);
    int moved = 0;
    for (std::size_t shard = 0; shard < before.size(); ++shard) moved += before[shard] != after[shard];
    EXPECT_LE(moved, 96);  // 64 must
}

TEST(Shards, TheHashIsFixed) {
    EXPECT_EQ(shardOf(0), 226);
    EXPECT_EQ(shardOf(1), 145);
    EXPECT_EQ(shardOf(INT64_MAX), 42);
    std::array<int, kShards> count{};
    for (std::int64_t id = 1; id <= 256'000; ++id) ++count[static_cast<std::size_t>(shardOf(id))];
    for (const int shapes : count) EXPECT_NEAR(shapes, 1'000, 130);
}

}  // namespace
}  // namespace shapedb::cluster
