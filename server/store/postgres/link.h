// SPDX-License-Identifier: GPL-3.0-or-later
// One connection of libpq: sends, and waits for what comes back. Functions throw Failure
// (server/store/failure.h): kUnavailable when the database cannot be reached, refuses connections, or only
// reads (a standby); a connection that was lost is not usable any more (isBroken).
//
// Everything is waited for with a limit: a database host that does not answer ends the call, not the thread.
#pragma once

#include <chrono>
#include <memory>
#include <string>
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

struct PostgresResultCloser {
    void operator()(pg_result* result) const noexcept;
};
using PostgresResult = std::unique_ptr<pg_result, PostgresResultCloser>;

class PostgresLink {
  public:
    explicit PostgresLink(const PostgresAddress& address);
    ~PostgresLink();
    PostgresLink(const PostgresLink&) = delete;
    PostgresLink& operator=(const PostgresLink&) = delete;

    // Each waits for the results of what it sends, and returns the last.

    /// One or more statements without parameters. Rows come as text.
    PostgresResult query(const std::string& sql);
    /// One statement without parameters. Rows come in binary form.
    PostgresResult rows(const std::string& sql);
    PostgresResult prepare(const std::string& name, const std::string& sql);
    PostgresResult describe(const std::string& name);
    /// Values in binary form; without data: NULL.
    PostgresResult execute(const std::string& name, const std::vector<BlobView>& values);

    // COPY ... TO STDOUT. Rows come while the database reads on. Whatever is sent before all have been read
    // ends it.

    void startCopy(const std::string& sql);
    /// False: that was all. `row` is what the database sent for one row, valid until the next call.
    bool nextOfCopy(BlobView& row);
    /// Reads what is left, and forgets it.
    void endCopy();

    [[nodiscard]] bool isBroken() const noexcept;
    /// Broken because the database did not answer in time.
    [[nodiscard]] bool hasTimedOut() const noexcept { return timedOut_; }
    [[nodiscard]] bool isInTransaction() const noexcept;  ///< and nothing has failed in it
    [[nodiscard]] bool isIdle() const noexcept;           ///< no transaction is open

  private:
    using Clock = std::chrono::steady_clock;
    struct BufferCloser {
        void operator()(char* buffer) const noexcept;
    };

    PostgresResult sent(int accepted, const char* what);
    PostgresResult await();
    PostgresResult nextResult(Clock::time_point until);
    void waitForSocket(bool writable, Clock::time_point until);
    void waitForInput(Clock::time_point until);
    void flush(Clock::time_point until);
    [[noreturn]] void raiseResult(const pg_result* result) const;
    [[noreturn]] void raiseConnection(const std::string& what) const;

    pg_conn* connection_ = nullptr;
    std::chrono::milliseconds patience_;
    bool timedOut_ = false;
    bool isCopying_ = false;
    std::unique_ptr<char, BufferCloser> copied_;
};

/// Whether the database undid the transaction because of another one: the work can be done again.
[[nodiscard]] bool isConflict(const Failure& failure) noexcept;

/// Whether the transaction gave up because another one kept a lock that it needs.
[[nodiscard]] bool isHeldUp(const Failure& failure) noexcept;

/// Errors: kInvalidArgument: libpq cannot read the URI, or it holds a password, which would be seen in lists
/// of processes and in files that are meant for all.
[[nodiscard]] Result<void> checkUri(const std::string& uri);

}  // namespace shapedb::store
