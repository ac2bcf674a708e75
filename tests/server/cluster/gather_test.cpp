// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/gather.h"

#include <functional>

#include <gtest/gtest.h>

namespace shapedb::cluster {
namespace {

/// Every shard is held by each of these servers, under the epoch 1 for the first, 2 for the second ...
RoutesPtr heldByAll(const std::vector<std::string>& servers) {
    ClusterView view;
    for (int shard = 0; shard < kShards; ++shard) {
        for (std::size_t i = 0; i < servers.size(); ++i) {
            view.leases.push_back({shard,
                                   static_cast<int>(i),
                                   servers[i],
                                   static_cast<std::int64_t>(i) + 1,
                                   std::chrono::milliseconds(1'000),
                                   {}});
        }
    }
    return routesOf(view);
}

Coverage asAsked(const Ask& ask, std::int64_t number = 10, std::int64_t generation = 1) {
    return {ask.shards, number, generation};
}

std::size_t shardsIn(const std::vector<Ask>& asks) {
    std::size_t count = 0;
    for (const Ask& ask : asks) count += ask.shards.size();
    return count;
}

TEST(Gather, AsksForEachShardOnceAndSpreadsThemOverReplicas) {
    Gather gather(heldByAll({"a", "b"}), 0, 0, 7);
    const auto asks = gather.start();
    ASSERT_EQ(asks.size(), 2u);
    EXPECT_EQ(asks[0].shards.size(), 128u);
    EXPECT_EQ(shardsIn(asks), 256u);
    EXPECT_FALSE(gather.complete());
    EXPECT_TRUE(gather.onAnswer(asks[0].id, asAsked(asks[0])).empty());
    EXPECT_TRUE(gather.onAnswer(asks[1].id, asAsked(asks[1])).empty());
    EXPECT_TRUE(gather.complete());
    EXPECT_EQ(gather.accepted(), (std::vector<std::uint64_t>{asks[0].id, asks[1].id}));
}

TEST(Gather, IgnoresAnAnswerThatComesTwice) {
    Gather gather(heldByAll({"a"}), 0, 0, 0);
    const auto asks = gather.start();
    EXPECT_TRUE(gather.onAnswer(asks[0].id, asAsked(asks[0])).empty());
    EXPECT_TRUE(gather.onAnswer(asks[0].id, asAsked(asks[0])).empty());
    EXPECT_EQ(gather.accepted().size(), 1u);
}

TEST(Gather, IgnoresAnAnswerThatComesAfterItsShardsWereAskedOfAnother) {
    Gather gather(heldByAll({"a", "b"}), 0, 0, 0);
    const auto asks = gather.start();
    const auto again = gather.onFailure(asks[0].id);
    ASSERT_EQ(again.size(), 1u);
    EXPECT_EQ(again[0].server, asks[1].server);
    EXPECT_EQ(again[0].shards.size(), asks[0].shards.size());
    EXPECT_TRUE(gather.onAnswer(asks[0].id, asAsked(asks[0])).empty());
    EXPECT_TRUE(gather.accepted().empty());
}

TEST(Gather, RefusesAnswersThatAreNotWhatWasAsked) {
    const auto refused = [](const std::function<void(Coverage&)>& change) {
        Gather gather(heldByAll({"a"}), 10, 0, 0);
        const auto asks = gather.start();
        Coverage coverage = asAsked(asks[0]);
        change(coverage);
        EXPECT_TRUE(gather.onAnswer(asks[0].id, coverage).empty());
        return gather.accepted().empty() && gather.needsRoutes() && !gather.complete();
    };
    EXPECT_FALSE(refused([](Coverage&) {}));
    EXPECT_TRUE(refused([](Coverage& coverage) { coverage.shards.pop_back(); })) << "a shard is missing";
    EXPECT_TRUE(refused([](Coverage& coverage) { ++coverage.shards[3].second; })) << "another epoch";
    EXPECT_TRUE(refused([](Coverage& coverage) { coverage.shards[3] = coverage.shards[4]; })) << "one twice";
    EXPECT_TRUE(refused([](Coverage& coverage) { coverage.number = 9; })) << "older than asked for";
}

TEST(Gather, ANewerGenerationTakesThePlaceOfTheOlder) {
    Gather gather(heldByAll({"a", "b"}), 0, 0, 0);
    const auto asks = gather.start();
    EXPECT_TRUE(gather.onAnswer(asks[0].id, asAsked(asks[0], 10, 1)).empty());
    const auto again = gather.onAnswer(asks[1].id, asAsked(asks[1], 11, 2));
    ASSERT_EQ(shardsIn(again), asks[0].shards.size());
    EXPECT_EQ(again[0].leastGeneration, 2);
    EXPECT_EQ(gather.generation(), 2);
    EXPECT_TRUE(gather.onAnswer(again[0].id, asAsked(again[0], 11, 2)).empty());
    EXPECT_TRUE(gather.complete());
    EXPECT_EQ(gather.accepted(), (std::vector<std::uint64_t>{asks[1].id, again[0].id}));
}

TEST(Gather, AsksNobodyTwiceUntilThereAreNewRoutes) {
    Gather gather(heldByAll({"a"}), 0, 0, 0);
    const auto asks = gather.start();
    EXPECT_TRUE(gather.onFailure(asks[0].id).empty());
    EXPECT_TRUE(gather.needsRoutes());
    const auto again = gather.onRoutes(heldByAll({"a"}));
    EXPECT_EQ(shardsIn(again), 256u);
    EXPECT_FALSE(gather.needsRoutes());
}

TEST(Gather, TellsWhatIsCoveredWhenShardsHaveNoHolder) {
    ClusterView view;
    view.leases.push_back({5, 0, "a", 1, std::chrono::milliseconds(1'000), {}});
    view.leases.push_back({6, 0, "a", 1, std::chrono::milliseconds(0), {}});     // ended
    view.leases.push_back({7, 0, "", 1, std::chrono::milliseconds(1'000), {}});  // given back
    Gather gather(routesOf(view), 0, 0, 0);
    const auto asks = gather.start();
    ASSERT_EQ(shardsIn(asks), 1u);
    EXPECT_TRUE(gather.onAnswer(asks[0].id, asAsked(asks[0])).empty());
    EXPECT_TRUE(gather.needsRoutes());
    EXPECT_EQ(gather.covered().count(), 1u);
    EXPECT_TRUE(gather.covered()[5]);
}

}  // namespace
}  // namespace shapedb::cluster
