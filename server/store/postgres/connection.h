// SPDX-License-Identifier: GPL-3.0-or-later
// The private layer over libpq. Functions throw Failure (server/store/failure.h): kUnavailable when the
// database cannot be reached, refuses connections, or only reads (a standby); a connection that was lost is
// not usable any more (isBroken).
//
// Every statement is waited for with a limit: a database host that does not answer ends the call, not the
// thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/store/sql/connection.h"

struct pg_conn;
struct pg_result;

namespace shapedb::store {

struct PostgresAddress {
    std::string uri;       ///< of libpq: "postgresql://host/database", or "host=... dbname=..."
    std::string password;  ///< empty: as the URI and libpq's own files say
    std::chrono::milliseconds patience{30'000};  ///< for a connection, and for each statement
    std::string serverName;                      ///< application_name, as the database shows it
};

/// What a kind of statement is called here when its text is not that of sql.h: by address of the shared text.
using StatementTexts = std::unordered_map<const char*, std::string>;

class PostgresConnection final : public Connection {
  public:
    /// `texts`, not owned, must outlive this.
    PostgresConnection(const PostgresAddress& address, const StatementTexts& texts);
    ~PostgresConnection() override;
    PostgresConnection(const PostgresConnection&) = delete;
    PostgresConnection& operator=(const PostgresConnection&) = delete;

    PreparedStatement& prepared(const char* sql) override;
    /// One snapshot for all statements.
    void beginRead() override;
    /// Each statement sees what is committed when it starts: a row is locked before it is read.
    void beginWrite() override;
    /// How long write transactions from now on wait for a lock that another transaction has; 0: for as long
    /// as the database may take to answer. Then Failure kUnavailable (isHeldUp).
    void waitForLocks(std::chrono::milliseconds atMost) noexcept { lockPatience_ = atMost; }
    /// Failure kUnavailable when the connection is lost meanwhile: then nobody knows whether it is stored.
    void commit() override;
    void rollback() noexcept override;
    void insertPoints(std::int64_t shapeId, std::uint64_t pointBytes, const BlobSource& blob) override;

    /// Runs one or more statements without parameters and ignores their rows.
    void execute(const std::string& sql);
    /// First column of the first row, empty if there is none; not cached.
    std::string text(const std::string& sql);

    [[nodiscard]] bool isBroken() const noexcept;
    /// Broken because the database did not answer in time.
    [[nodiscard]] bool hasTimedOut() const noexcept { return timedOut_; }

  private:
    class CachedStatement;
    struct ResultCloser {
        void operator()(pg_result* result) const noexcept;
    };
    using ResultPtr = std::unique_ptr<pg_result, ResultCloser>;

    /// Waits for the results of what was sent, and returns the last. Throws Failure for an error.
    ResultPtr await();
    void waitForSocket(bool writable, std::chrono::steady_clock::time_point until);
    void flush(std::chrono::steady_clock::time_point until);
    [[noreturn]] void raiseResult(const pg_result* result) const;
    [[noreturn]] void raiseConnection(const std::string& what) const;

    pg_conn* connection_ = nullptr;
    const StatementTexts& texts_;
    std::chrono::milliseconds patience_;
    std::chrono::milliseconds lockPatience_{0};
    bool timedOut_ = false;
    std::unordered_map<const char*, std::unique_ptr<CachedStatement>> statements_;
};

/// Errors: kInvalidArgument: libpq cannot read the URI, or it holds a password, which would be seen in lists
/// of processes and in files that are meant for all.
[[nodiscard]] Result<void> checkUri(const std::string& uri);

/// Whether the database undid the transaction because of another one: the work can be done again.
[[nodiscard]] bool isConflict(const Failure& failure) noexcept;

/// Whether the transaction gave up because another one kept a lock that it needs.
[[nodiscard]] bool isHeldUp(const Failure& failure) noexcept;

}  // namespace shapedb::store
