// SPDX-License-Identifier: GPL-3.0-or-later
// The layer over libpq: values keep every bit, rows come in any number, and a database that is lost is told.
#include "server/store/postgres/connection.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/store/postgres/statement.h"
#include "tests/server/support/postgres_cluster.h"

namespace shapedb::store {
namespace {

constexpr char kInsert[] = "INSERT INTO t (i, r, s, b) VALUES (?1, ?2, ?3, ?4)";
constexpr char kAll[] = "SELECT i, r, s, b FROM t ORDER BY n";
constexpr char kCount[] = "SELECT count(*) FROM t";
constexpr char kCopy[] =
    "COPY (SELECT i, r, s, b FROM t WHERE n > ?1 AND s IS DISTINCT FROM ?2 ORDER BY n) TO STDOUT (FORMAT "
    "binary)";
constexpr char kCopyNone[] = "COPY (SELECT n, s FROM t WHERE false) TO STDOUT (FORMAT binary)";
constexpr char kCopyFails[] = "COPY (SELECT 1 / (n - 500) FROM t ORDER BY n) TO STDOUT (FORMAT binary)";
constexpr char kSleep[] = "SELECT pg_sleep(30)";
constexpr char kFails[] = "INSERT INTO t (n) VALUES (1), (1)";
constexpr char kLock[] = "SELECT n FROM t WHERE n = ?1 FOR UPDATE";

class PostgresConnectionTest : public ::testing::Test {
  protected:
    void SetUp() override {
        SHAPEDB_USE_POSTGRES(cluster_);
        uri_ = cluster_->createDatabase();
        connection_ = connect();
        connection_->execute(
            "CREATE TABLE t (n bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, i bigint, r double "
            "precision, s text, "
            "b bytea)");
    }

    std::unique_ptr<PostgresConnection> connect(
        std::chrono::milliseconds patience = std::chrono::seconds(60)) {
        return std::make_unique<PostgresConnection>(PostgresAddress{uri_, {}, patience, "test"}, none_);
    }
    static ErrorCode codeOf(const std::function<void()>& body) {
        const auto failed = guarded("try", body);
        EXPECT_FALSE(failed);
        return failed ? ErrorCode::kInternal : failed.error().code;
    }
    void insert(std::int64_t i, double r, const std::string& s, const std::string& b) {
        Query(*connection_, kInsert, i, r, s, viewOf(b)).run();
    }

    shapedb::testing::PostgresCluster* cluster_ = nullptr;
    std::string uri_;
    StatementTexts none_;
    std::unique_ptr<PostgresConnection> connection_;
};

TEST_F(PostgresConnectionTest, ValuesKeepEveryBit) {
    using Numbers = std::numeric_limits<double>;
    const std::vector<std::int64_t> integers = {0, -1, INT64_MAX, INT64_MIN, 255, -256};
    const std::vector<double> reals = {
        0.1, -0.0, Numbers::denorm_min(), Numbers::max(), Numbers::infinity(), -1e-300};
    const std::vector<std::string> texts = {"",  "it's", "\xc3\xa4 $1 ?", "a\nb\\c", std::string(70'000, 'x'),
                                            "\""};
    const std::vector<std::string> blobs = {
        "", std::string("\0a\0", 3), "\xff\xfe", std::string(100'000, '\0'), "'", "\\x"};
    Transaction transaction(*connection_, Transaction::Kind::kWrite);
    for (std::size_t k = 0; k < integers.size(); ++k) insert(integers[k], reals[k], texts[k], blobs[k]);
    transaction.commit();
    const Transaction snapshot(*connection_, Transaction::Kind::kRead);
    Query query(*connection_, kAll);
    for (std::size_t k = 0; k < integers.size(); ++k) {
        ASSERT_TRUE(query.step());
        EXPECT_EQ(query.integer(0), integers[k]);
        EXPECT_EQ(query.real(1), reals[k]);
        EXPECT_EQ(std::signbit(query.real(1)), std::signbit(reals[k]));
        EXPECT_EQ(query.text(2), texts[k]);
        EXPECT_EQ(bytesOf(query.blob(3)), blobs[k]);
        EXPECT_FALSE(query.isNull(3)) << "an empty blob is none of NULL";
    }
    EXPECT_FALSE(query.step());
}

TEST_F(PostgresConnectionTest, NullIsToldFromEmpty) {
    Transaction transaction(*connection_, Transaction::Kind::kWrite);
    Query(*connection_, kInsert, 1, 2.0, std::string("s"), BlobOrNull{}).run();
    Query query(*connection_, kAll);
    ASSERT_TRUE(query.step());
    EXPECT_TRUE(query.isNull(3));
    EXPECT_EQ(query.blob(3).size, 0u);
}

TEST_F(PostgresConnectionTest, ManyRowsComeInOrderAndMayBeLeft) {
    connection_->execute("INSERT INTO t (i) SELECT g FROM generate_series(0, 2999) g");
    for (const int wanted : {3000, 256, 257, 1, 0}) {
        const Transaction snapshot(*connection_, Transaction::Kind::kRead);
        {
            Query query(*connection_, kAll);
            for (int i = 0; i < wanted; ++i) {
                ASSERT_TRUE(query.step()) << i;
                ASSERT_EQ(query.integer(0), i);
            }
            if (wanted == 3000) {
                EXPECT_FALSE(query.step());
            }
        }
        // What was left is closed: another may begin.
        EXPECT_EQ(numberOf(Query(*connection_, kCount)), 3000);
    }
}

TEST_F(PostgresConnectionTest, ACopyKeepsEveryBit) {
    std::string bytes;
    for (int i = 0; i < 100'000; ++i) bytes += static_cast<char>(i * 37);
    insert(-3, 0.1, "it's", bytes);
    insert(std::numeric_limits<std::int64_t>::max(), -0.0, "", "");
    insert(0, 0, "left out ' $1 ?2", "x");
    connection_->execute("INSERT INTO t (i) VALUES (7)");
    for (int run = 0; run < 2; ++run) {
        Query query(*connection_, kCopy, -1, std::string("left out ' $1 ?2"));
        ASSERT_TRUE(query.step());
        EXPECT_EQ(query.integer(0), -3);
        EXPECT_EQ(query.real(1), 0.1);
        EXPECT_EQ(query.text(2), "it's");
        EXPECT_EQ(bytesOf(query.blob(3)), bytes);
        ASSERT_TRUE(query.step());
        EXPECT_EQ(query.integer(0), std::numeric_limits<std::int64_t>::max());
        EXPECT_TRUE(std::signbit(query.real(1)));
        EXPECT_FALSE(query.isNull(2));
        EXPECT_EQ(query.text(2), "");
        EXPECT_FALSE(query.isNull(3));
        EXPECT_EQ(query.blob(3).size, 0u);
        ASSERT_TRUE(query.step());
        EXPECT_EQ(query.integer(0), 7);
        for (int column = 1; column < 4; ++column) EXPECT_TRUE(query.isNull(column));
        EXPECT_FALSE(query.step());
        EXPECT_FALSE(query.step()) << "it is not started again";
    }
    Query none(*connection_, kCopyNone);
    EXPECT_FALSE(none.step());
}

TEST_F(PostgresConnectionTest, ACopyMayBeLeftOrInterrupted) {
    connection_->execute("INSERT INTO t (i) SELECT * FROM generate_series(1, 1000)");
    {
        Query query(*connection_, kCopy, 0, std::string());
        for (int i = 1; i <= 10; ++i) {
            ASSERT_TRUE(query.step());
            EXPECT_EQ(query.integer(0), i);
        }
    }
    {
        Query query(*connection_, kCopy, 10, std::string());
        ASSERT_TRUE(query.step());
        EXPECT_EQ(query.integer(0), 11);
        Query count(*connection_, kCount);
        ASSERT_TRUE(count.step());
        EXPECT_EQ(count.integer(0), 1'000);
        EXPECT_FALSE(query.step()) << "what was left is lost";
    }
    Query query(*connection_, kCopy, 998, std::string());
    ASSERT_TRUE(query.step());
    ASSERT_TRUE(query.step());
    EXPECT_EQ(query.integer(0), 1'000);
    EXPECT_FALSE(query.step());
}

TEST_F(PostgresConnectionTest, ACopyThatFailsHalfwayIsTold) {
    connection_->execute("INSERT INTO t (i) SELECT * FROM generate_series(1, 1000)");
    connection_->beginRead();
    EXPECT_EQ(codeOf([&] {
                  Query query(*connection_, kCopyFails);
                  query.run();
              }),
              ErrorCode::kInternal);
    EXPECT_FALSE(connection_->isBroken());
    connection_->rollback();
    EXPECT_EQ(connection_->text("SELECT count(*) FROM t"), "1000");
}

TEST_F(PostgresConnectionTest, AFailedTransactionIsNeverTakenForCommitted) {
    Transaction transaction(*connection_, Transaction::Kind::kWrite);
    insert(1, 1, "", "");
    EXPECT_EQ(codeOf([&] { Query(*connection_, kFails).run(); }), ErrorCode::kInternal);
    EXPECT_EQ(codeOf([&] { transaction.commit(); }), ErrorCode::kInternal);
    EXPECT_FALSE(connection_->isBroken());
}

TEST_F(PostgresConnectionTest, WhatIsNotCommittedIsUndone) {
    {
        const Transaction transaction(*connection_, Transaction::Kind::kWrite);
        insert(1, 1, "", "");
        EXPECT_EQ(numberOf(Query(*connection_, kCount)), 1);
    }
    EXPECT_EQ(numberOf(Query(*connection_, kCount)), 0);
}

TEST_F(PostgresConnectionTest, ADatabaseThatDoesNotAnswerEndsTheCall) {
    const auto impatient = connect(std::chrono::milliseconds(1'000));
    EXPECT_EQ(codeOf([&] { Query(*impatient, kSleep).run(); }), ErrorCode::kUnavailable);
    EXPECT_TRUE(impatient->isBroken());
}

TEST_F(PostgresConnectionTest, AWaitForALockEndsInTheDatabaseFirst) {
    connection_->execute("INSERT INTO t (i) VALUES (1)");
    const Transaction holding(*connection_, Transaction::Kind::kWrite);
    Query(*connection_, kLock, 1).run();
    const auto impatient = connect(std::chrono::milliseconds(2'000));
    impatient->beginWrite();
    const auto waited = guarded("try", [&] { Query(*impatient, kLock, 1).run(); });
    ASSERT_FALSE(waited);
    EXPECT_EQ(waited.error().code, ErrorCode::kUnavailable);
    EXPECT_NE(waited.error().message.find("another transaction"), std::string::npos)
        << waited.error().message;
    EXPECT_FALSE(impatient->isBroken());
    impatient->rollback();
    EXPECT_EQ(numberOf(Query(*impatient, kCount)), 1) << "it can be used again";
}

TEST_F(PostgresConnectionTest, NoRoomIsTold) {
    const auto raise = [&](const std::string& state) {
        return codeOf([&] { connection_->execute("DO $$ BEGIN RAISE SQLSTATE '" + state + "'; END $$"); });
    };
    EXPECT_EQ(raise("53100"), ErrorCode::kStorageFull);
    EXPECT_EQ(raise("53200"), ErrorCode::kOutOfMemory);
    EXPECT_EQ(raise("53300"), ErrorCode::kUnavailable);
}

// A port that takes connections, and never says a word.
TEST_F(PostgresConnectionTest, TheUriMayGiveUpAHostSooner) {
    const int silent = ::socket(AF_INET, SOCK_STREAM, 0);
    ASSERT_GE(silent, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const place = reinterpret_cast<sockaddr*>(&address);
    ASSERT_EQ(::bind(silent, place, size), 0);
    ASSERT_EQ(::listen(silent, 8), 0);
    ASSERT_EQ(::getsockname(silent, place, &size), 0);
    uri_ = "host=127.0.0.1 dbname=x connect_timeout=2 port=" + std::to_string(ntohs(address.sin_port));
    const auto began = std::chrono::steady_clock::now();
    EXPECT_EQ(codeOf([&] { connect(); }), ErrorCode::kUnavailable);
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(30));
    ::close(silent);
}

TEST_F(PostgresConnectionTest, ALostDatabaseIsTold) {
    cluster_->restart();
    EXPECT_EQ(codeOf([&] { Query(*connection_, kCount).run(); }), ErrorCode::kUnavailable);
    EXPECT_TRUE(connection_->isBroken());
    EXPECT_EQ(numberOf(Query(*connect(), kCount)), 0) << "it is there again";
    EXPECT_EQ(codeOf([&] {
                  PostgresConnection({"host=/nowhere dbname=x", {}, std::chrono::seconds(5), "test"}, none_);
              }),
              ErrorCode::kUnavailable);
}

TEST_F(PostgresConnectionTest, AConflictIsToldApart) {
    connection_->execute("INSERT INTO t (i) VALUES (1), (2)");
    const auto other = connect();
    Transaction one(*connection_, Transaction::Kind::kWrite);
    Transaction two(*other, Transaction::Kind::kWrite);
    Query(*connection_, kLock, 1).run();
    Query(*other, kLock, 2).run();
    bool conflict = false;
    const auto lock = [&](PostgresConnection& connection, int row) {
        try {
            Query(connection, kLock, row).run();
        } catch (const Failure& failure) {
            EXPECT_TRUE(isConflict(failure)) << failure.what();
            conflict = true;
            connection.rollback();
        }
    };
    std::thread waiting([&] { lock(*other, 1); });
    lock(*connection_, 2);
    waiting.join();
    EXPECT_TRUE(conflict);
}

TEST(PostgresUri, MayNotHoldAPassword) {
    EXPECT_TRUE(checkUri("postgresql://me@db.example/shapes?sslmode=verify-full"));
    EXPECT_TRUE(checkUri("host=/run/postgresql dbname=shapes"));
    for (const char* uri :
         {"postgresql://me:secret@db/shapes", "host=db password=secret", "postgresql://[x"}) {
        const auto refused = checkUri(uri);
        ASSERT_FALSE(refused) << uri;
        EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
        EXPECT_EQ(refused.error().message.find("secret"), std::string::npos) << refused.error().message;
    }
}

TEST(SqlLiteral, CannotBeLeft) {
    EXPECT_EQ(sqlLiteral("a'b"), "'a''b'");
    EXPECT_EQ(sqlLiteral("'; DROP TABLE shape; --"), "'''; DROP TABLE shape; --'");
}

}  // namespace
}  // namespace shapedb::store
