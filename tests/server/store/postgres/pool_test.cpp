// SPDX-License-Identifier: GPL-3.0-or-later
// What calls wait for when connections are short, or the database does not answer: never longer than it may
// take.
#include "server/store/postgres/pool.h"

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/store/postgres/transactions.h"
#include "tests/server/support/postgres_cluster.h"

namespace shapedb::store {
namespace {

using Clock = std::chrono::steady_clock;
using Use = PostgresPool::Use;

constexpr std::chrono::milliseconds kPatience{1'000};
constexpr char kLongSleep[] = "SELECT pg_sleep(30)";

class PostgresPoolTest : public ::testing::Test {
  protected:
    void SetUp() override {
        SHAPEDB_USE_POSTGRES(cluster_);
        address_ = {cluster_->createDatabase(), {}, kPatience, "test"};
    }

    std::vector<std::unique_ptr<PostgresPool::Lease>> take(PostgresPool& pool, Use use, int count) {
        std::vector<std::unique_ptr<PostgresPool::Lease>> leases;
        for (int i = 0; i < count; ++i) {
            leases.push_back(
                std::unique_ptr<PostgresPool::Lease>(new PostgresPool::Lease(pool.acquire(use))));
        }
        return leases;
    }
    static Result<void> tried(PostgresPool& pool, Use use) {
        return guarded("try", [&] { static_cast<void>(pool.acquire(use)); });
    }

    shapedb::testing::PostgresCluster* cluster_ = nullptr;
    PostgresAddress address_;
    StatementTexts none_;
};

TEST_F(PostgresPoolTest, WritesLeaveAQuarterForReads) {
    PostgresPool pool(address_, none_, 8);
    const auto writes = take(pool, Use::kWrite, 6);
    const auto began = Clock::now();
    const auto refused = tried(pool, Use::kWrite);
    const auto took = Clock::now() - began;
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(refused.error().message.find("for writing are in use"), std::string::npos)
        << refused.error().message;
    EXPECT_GE(took, kPatience);
    EXPECT_LT(took, 5 * kPatience);
    const auto reads = take(pool, Use::kRead, 2);
    EXPECT_FALSE(tried(pool, Use::kRead));
}

TEST_F(PostgresPoolTest, OneConnectionIsForBoth) {
    PostgresPool pool(address_, none_, 1);
    EXPECT_TRUE(tried(pool, Use::kWrite));
    EXPECT_TRUE(tried(pool, Use::kRead));
}

TEST_F(PostgresPoolTest, AConnectionForWritingIsGivenBack) {
    PostgresPool pool(address_, none_, 2);
    auto write = take(pool, Use::kWrite, 1);
    const auto read = take(pool, Use::kRead, 1);
    std::thread waiting([&] { EXPECT_TRUE(tried(pool, Use::kWrite)); });
    std::this_thread::sleep_for(kPatience / 10);
    write.clear();
    waiting.join();
}

TEST_F(PostgresPoolTest, ADatabaseThatDoesNotAnswerIsNotAskedTwice) {
    PostgresPool pool(address_, none_, 2);
    const auto ask = [](Connection& connection) { Query(connection, kLongSleep).run(); };
    const auto reads = [&] { inReadTransaction(pool, ask); };
    const auto writes = [&] { inWriteTransaction(pool, false, ask); };
    for (const std::function<void()>& once : {std::function<void()>(reads), std::function<void()>(writes)}) {
        const auto began = Clock::now();
        const auto done = guarded("try", once);
        ASSERT_FALSE(done);
        EXPECT_EQ(done.error().code, ErrorCode::kUnavailable);
        EXPECT_LT(Clock::now() - began, 2 * kPatience - kPatience / 10);
    }
}

TEST_F(PostgresPoolTest, AConnectionThatWentStaleIsReplaced) {
    PostgresPool pool(address_, none_, 2);
    int runs = 0;
    const auto ask = [&](Connection& connection) {
        ++runs;
        Query(connection, "SELECT 1").run();
    };
    inReadTransaction(pool, ask);
    cluster_->restart();
    inWriteTransaction(pool, false, ask);
    cluster_->restart();
    inReadTransaction(pool, ask);
    EXPECT_EQ(runs, 3) << "the others have failed at BEGIN";
}

TEST_F(PostgresPoolTest, WhoWaitsForALockLetsOthersWrite) {
    address_.patience = 20 * kPatience;
    PostgresPool pool(address_, none_, 4);
    PostgresConnection other(address_, none_);
    other.execute("CREATE TABLE counted (id int PRIMARY KEY, n int NOT NULL)");
    other.execute("INSERT INTO counted VALUES (1, 0), (2, 0)");
    const auto add = [&](const std::string& id) {
        return guarded("add", [&] {
            inWriteTransaction(pool, false, [&](Connection& connection) {
                dynamic_cast<PostgresConnection&>(connection)
                    .execute("UPDATE counted SET n = n + 1 WHERE id = " + id);
            });
        });
    };
    other.execute("BEGIN; UPDATE counted SET n = n + 1 WHERE id = 1");
    std::vector<std::thread> waiting;
    for (int i = 0; i < 12; ++i) waiting.emplace_back([&] { EXPECT_TRUE(add("1")); });
    // Until all that may write wait for the row.
    PostgresConnection watching(address_, none_);  // inside a transaction it would see the same for ever
    while (watching.text("SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock'") != "3") {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(add("2")) << "another row than the one that is kept";
    other.execute("COMMIT");
    for (std::thread& thread : waiting) thread.join();
    EXPECT_EQ(other.text("SELECT n FROM counted WHERE id = 1"), "13");
    EXPECT_EQ(other.text("SELECT n FROM counted WHERE id = 2"), "5");
}

TEST_F(PostgresPoolTest, ALockThatIsNeverGivenUpIsToldAfterAllPatience) {
    PostgresPool pool(address_, none_, 2);
    PostgresConnection other(address_, none_);
    other.execute("CREATE TABLE kept (id int PRIMARY KEY)");
    other.execute("BEGIN; LOCK TABLE kept");
    const auto began = Clock::now();
    const auto done = guarded("write", [&] {
        inWriteTransaction(pool, false, [](Connection& connection) {
            dynamic_cast<PostgresConnection&>(connection).execute("INSERT INTO kept VALUES (1)");
        });
    });
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(done.error().message.find("another transaction"), std::string::npos) << done.error().message;
    EXPECT_GE(Clock::now() - began, kPatience);
    EXPECT_LT(Clock::now() - began, 2 * kPatience);
}

}  // namespace
}  // namespace shapedb::store
