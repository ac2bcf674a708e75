// SPDX-License-Identifier: GPL-3.0-or-later
// The leases in the database are those that the simulated one gives, also when several ask at the same time.
// Time passes by moving what is stored into the past.
#include "server/cluster/lease_table.h"

#include <map>
#include <mutex>
#include <thread>
#include <tuple>

#include "tests/server/cluster/simulated_database.h"
#include "tests/server/store/store_fixture.h"
#include "tests/support/scale.h"

namespace shapedb::store {
namespace {

using cluster::Beat;
using cluster::ClusterView;
using cluster::Lease;
using cluster::SlotSeen;

// Long, compared with what the test itself takes: the model's clock stands still meanwhile.
constexpr std::int64_t kStepMs = 100'000;
constexpr std::chrono::milliseconds kLeaseTerm(10 * kStepMs);

class PostgresLeaseTableTest : public StoreTest {
  protected:
    Engine engine() const override { return Engine::kPostgres; }
    std::unique_ptr<cluster::LeaseTable> table(int replicas) const { return leaseTable(*store_, replicas); }

    void pass(std::int64_t milliseconds) {
        const std::string by = std::to_string(milliseconds);
        execute("UPDATE cluster_slot SET lease_end = lease_end - " + by);
        execute("UPDATE cluster_server SET until = until - " + by);
    }
    std::string text(const std::string& sql) const {
        return PostgresConnection({database_, {}, std::chrono::seconds(60), "test"}, {}).text(sql);
    }
};

Beat beatOf(const std::string& server) {
    Beat beat;
    beat.server = server;
    beat.term = kLeaseTerm;
    return beat;
}

std::string described(const Lease& lease) {
    return std::to_string(lease.shard) + "/" + std::to_string(lease.slot) + " of '" + lease.holder +
           "' epoch " + std::to_string(lease.epoch) + (lease.left.count() > 0 ? " held" : " ended") +
           " wanted by '" + lease.wantedBy + "'";
}

void expectSame(const ClusterView& found, const ClusterView& expected) {
    EXPECT_EQ(found.servers, expected.servers);
    ASSERT_EQ(found.leases.size(), expected.leases.size());
    for (std::size_t i = 0; i < found.leases.size(); ++i) {
        ASSERT_EQ(described(found.leases[i]), described(expected.leases[i]));
        if (expected.leases[i].left.count() <= 0) continue;
        const auto late = expected.leases[i].left - found.leases[i].left;
        EXPECT_GE(late.count(), 0);
        EXPECT_LT(late.count(), kStepMs);
    }
}

/// Of some slots, with the epochs that they have now, had, or may have.
std::vector<SlotSeen> someSlots(Random& random, const ClusterView& view, int replicas) {
    std::vector<SlotSeen> slots;
    for (std::uint64_t i = random.below(6); i > 0; --i) {
        const Lease& lease = view.leases[random.below(8 * static_cast<std::uint64_t>(replicas))];
        const std::int64_t epoch = random.below(5) > 0 ? lease.epoch : lease.epoch + 1 - random.below(3);
        slots.push_back({lease.shard, lease.slot, epoch});
    }
    return slots;
}

TEST_F(PostgresLeaseTableTest, GivesTheLeasesOfTheModel) {
    for (int seed = 1; seed <= testing::testScale(); ++seed) {
        execute("DELETE FROM cluster_slot");
        execute("DELETE FROM cluster_server");
        Random random(static_cast<std::uint64_t>(seed));
        const int replicas = 1 + seed % 2;
        const auto database = table(replicas);
        cluster::sim::Database model(replicas);
        model.now = 10 * kStepMs;  // free slots have ended
        ClusterView known = model.view().value();
        expectSame(database->view().value(), known);
        for (int step = 0; step < 400 && !HasFailure(); ++step) {
            if (random.below(3) == 0) {
                const auto by = static_cast<std::int64_t>(1 + random.below(6)) * kStepMs;
                model.now += by;
                pass(by);
            }
            Beat beat = beatOf(std::string(1, static_cast<char>('a' + random.below(4))));
            beat.leaving = random.below(10) == 0;
            for (auto* slots : {&beat.renew, &beat.take, &beat.want, &beat.handOver})
                *slots = someSlots(random, known, replicas);
            known = model.beat(beat).value();
            const auto found = database->beat(beat);
            ASSERT_TRUE(found) << found.error().message;
            SCOPED_TRACE("seed " + std::to_string(seed) + " step " + std::to_string(step));
            expectSame(*found, known);
            if (random.below(10) == 0) expectSame(database->view().value(), known);
        }
    }
}

TEST_F(PostgresLeaseTableTest, ServersThatBeatAtTheSameTimeNeverHaveTheSameLease) {
    std::mutex mutex;
    std::map<std::tuple<int, int, std::int64_t>, std::string> holders;
    const auto run = [&](const std::string& name, std::uint64_t seed) {
        const auto mine = table(2);
        Random random(seed);
        ClusterView view = mine->view().value();
        for (int i = 0; i < 60; ++i) {
            Beat beat = beatOf(name);
            for (const Lease& lease : view.leases) {
                const SlotSeen seen{lease.shard, lease.slot, lease.epoch};
                const bool isFree = lease.holder.empty() || lease.left.count() <= 0;
                if (isFree) {
                    beat.take.push_back(seen);
                } else if (lease.holder != name) {
                    beat.want.push_back(seen);
                } else {
                    (random.below(3) == 0 ? beat.handOver : beat.renew).push_back(seen);
                }
            }
            const auto after = mine->beat(beat);
            ASSERT_TRUE(after) << after.error().message;
            view = *after;
            const std::lock_guard<std::mutex> lock(mutex);
            for (const Lease& lease : view.leases) {
                if (lease.left.count() <= 0) continue;
                const auto held =
                    holders.emplace(std::make_tuple(lease.shard, lease.slot, lease.epoch), lease.holder);
                EXPECT_EQ(held.first->second, lease.holder)
                    << "shard " << lease.shard << " epoch " << lease.epoch;
            }
        }
    };
    std::vector<std::thread> servers;
    for (int i = 0; i < 3; ++i)
        servers.emplace_back(run, std::string(1, static_cast<char>('a' + i)), std::uint64_t(i));
    for (std::thread& server : servers) server.join();
    EXPECT_GT(holders.size(), 5'000u);
}

TEST_F(PostgresLeaseTableTest, SlotsComeAndGoWithTheirNumber) {
    const auto one = table(1);
    const auto two = table(2);
    EXPECT_FALSE(one->beat(beatOf("a"))->resized) << "nothing was there before";
    EXPECT_FALSE(one->beat(beatOf("a"))->resized);
    EXPECT_EQ(text("SELECT count(*) FROM cluster_slot"), "256");
    const ClusterView more = two->beat(beatOf("a")).value();
    ASSERT_EQ(more.leases.size(), 512u);
    EXPECT_TRUE(more.resized);
    EXPECT_FALSE(two->beat(beatOf("a"))->resized);
    Beat taking = beatOf("a");
    taking.take = {{7, 0, more.leases[14].epoch}, {7, 1, more.leases[15].epoch}};
    const ClusterView taken = two->beat(taking).value();
    EXPECT_EQ(taken.leases[15].holder, "a");
    const std::int64_t epoch = taken.leases[15].epoch;

    // Fewer: what is held is not seen, and goes when its lease has ended.
    const ClusterView fewer = one->beat(beatOf("b")).value();
    ASSERT_EQ(fewer.leases.size(), 256u);
    EXPECT_TRUE(fewer.resized);
    EXPECT_EQ(fewer.leases[7].holder, "a");
    EXPECT_EQ(text("SELECT count(*) FROM cluster_slot"), "257");
    Beat beyond = beatOf("b");
    beyond.want = {{7, 1, epoch}};
    beyond.take = {{3, 1, 0}, {300, 0, 0}};
    ASSERT_TRUE(one->beat(beyond)) << "what is not there changes nothing";
    EXPECT_EQ(text("SELECT wanted_by FROM cluster_slot WHERE shard = 7 AND slot = 1"), "");
    pass(kLeaseTerm.count());
    ASSERT_TRUE(one->beat(beatOf("b")));
    EXPECT_EQ(text("SELECT count(*) FROM cluster_slot"), "256");

    // More again: no epoch comes twice.
    const ClusterView again = two->beat(beatOf("b")).value();
    EXPECT_EQ(again.leases[15].holder, "");
    EXPECT_GT(again.leases[15].epoch, epoch);
}

TEST_F(PostgresLeaseTableTest, ServersThatAreLongDeadAreForgotten) {
    const auto leases = table(1);
    ASSERT_TRUE(leases->beat(beatOf("dying")));
    pass(kLeaseTerm.count());
    EXPECT_EQ(leases->beat(beatOf("other"))->servers, std::vector<std::string>{"other"});
    EXPECT_EQ(text("SELECT count(*) FROM cluster_server"), "2");
    pass(3'600'000);
    ASSERT_TRUE(leases->beat(beatOf("other")));
    EXPECT_EQ(text("SELECT count(*) FROM cluster_server"), "1");
}

TEST_F(PostgresLeaseTableTest, ADatabaseThatHasBeenAwayIsAskedAgain) {
    const auto leases = table(1);
    ASSERT_TRUE(leases->beat(beatOf("a")));
    cluster_->restart();
    const auto after = leases->beat(beatOf("a"));
    ASSERT_TRUE(after) << after.error().message;
    EXPECT_EQ(after->servers, std::vector<std::string>{"a"});
}

// Of the writes it is said that they are stored or not. Leases are renewed, or no search would go on.
TEST_F(PostgresLeaseTableTest, NoBeatWaitsForAStandby) {
    const auto leases = table(1);
    ASSERT_TRUE(leases->beat(beatOf("a")));
    static_cast<void>(text("ALTER SYSTEM SET synchronous_standby_names = 'nobody'"));
    static_cast<void>(text("SELECT pg_reload_conf()"));
    PostgresConnection impatient({database_, {}, std::chrono::seconds(1), "test"}, {});
    const auto isWaitedFor = [&] {
        return !guarded("write", [&] { impatient.execute("CREATE TABLE waits (n bigint)"); });
    };
    EXPECT_TRUE(isWaitedFor());
    const auto beaten = leases->beat(beatOf("b"));
    static_cast<void>(text("ALTER SYSTEM RESET synchronous_standby_names"));
    static_cast<void>(text("SELECT pg_reload_conf()"));
    ASSERT_TRUE(beaten) << beaten.error().message;
    EXPECT_EQ(beaten->servers, (std::vector<std::string>{"a", "b"}));
}

// It stops with the lock of the table in its hand.
TEST_F(PostgresLeaseTableTest, AServerThatHangsHoldsUpNobodyForLong) {
    const StatementTexts none;
    PostgresConnection hanging({database_, {}, std::chrono::seconds(60), "test"}, none);
    hanging.beginWrite();
    hanging.execute(
        "SELECT set_config('idle_in_transaction_session_timeout', '200', true), "
        "pg_advisory_xact_lock(1399350341)");
    EXPECT_TRUE(table(1)->beat(beatOf("a")));
    EXPECT_FAILS(guarded("go on", [&] { hanging.execute("SELECT 1"); }), ErrorCode::kUnavailable);
}

TEST(LeaseTable, IsThatOfPostgresAlone) {
    const Folder folder;
    SqliteOptions options;
    options.path = folder.file("shapes.db");
    const auto alone = openSqliteStore(options).value();
    EXPECT_EQ(leaseTable(*alone, 1), nullptr);
    EXPECT_EQ(replicaSource(*alone), nullptr);
}

}  // namespace
}  // namespace shapedb::store
