// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/cluster/simulation.h"

#include <cstdlib>

#include <gtest/gtest.h>

namespace shapedb::cluster::sim {
namespace {

TEST(ClusterSimulation, IsAlwaysTheSameForASeed) {
    const Outcome one = simulate({});
    const Outcome other = simulate({});
    EXPECT_EQ(one.answers, other.answers);
    EXPECT_EQ(one.changes, other.changes);
    EXPECT_EQ(one.difference, other.difference);
}

TEST(ClusterSimulation, WithoutFaultsEverySearchIsAnswered) {
    std::uint64_t switches = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        Options options;
        options.seed = seed;
        options.faults = false;
        options.replicas = 1 + static_cast<int>(seed % 2);
        const Outcome outcome = simulate(options);
        EXPECT_EQ(outcome.difference, "");
        EXPECT_EQ(outcome.unavailable, 0u);
        EXPECT_GT(outcome.answers, 200u);
        switches += outcome.switches;
    }
    EXPECT_GT(switches, 10u);
}

TEST(ClusterSimulation, NoHistoryShowsAWrongAnswer) {
    const char* scale = std::getenv("SHAPEDB_TEST_SCALE");
    const std::uint64_t seeds = 600 * (scale != nullptr ? static_cast<std::uint64_t>(std::atoi(scale)) : 1);
    Outcome all;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        Options options;
        options.seed = seed;
        options.servers = 2 + static_cast<int>(seed % 3);
        options.replicas = 1 + static_cast<int>(seed % 2);
        const Outcome outcome = simulate(options);
        ASSERT_EQ(outcome.difference, "");
        all.answers += outcome.answers;
        all.unavailable += outcome.unavailable;
        all.faults += outcome.faults;
        all.switches += outcome.switches;
    }
    RecordProperty("answers", std::to_string(all.answers));
    EXPECT_GT(all.answers, seeds * 100);
    EXPECT_GT(all.faults, seeds * 5);
    EXPECT_GT(all.switches, seeds);
    std::printf("%llu histories: %llu answers, %llu searches given up, %llu faults, %llu switches\n",
                static_cast<unsigned long long>(seeds), static_cast<unsigned long long>(all.answers),
                static_cast<unsigned long long>(all.unavailable), static_cast<unsigned long long>(all.faults),
                static_cast<unsigned long long>(all.switches));
}

}  // namespace
}  // namespace shapedb::cluster::sim
