// SPDX-License-Identifier: GPL-3.0-or-later
// Connections to the database, each lent to one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <variant>
#include <vector>

#include "server/store/postgres/connection.h"

namespace shapedb::store {

/// Thread-safe. Must outlive its leases.
class PostgresPool {
  public:
    /// Writes may wait for another transaction. They never have all connections: a quarter, at least one, is
    /// for reads, where there is more than one.
    enum class Use { kRead, kWrite };

    using Clock = std::chrono::steady_clock;

    /// Opens connections when they are needed, at most `most` of them.
    PostgresPool(const PostgresAddress& address, const StatementTexts& texts, int most)
        : address_(address),
          texts_(texts),
          left_(most),
          writesLeft_(std::max(1, most - std::max(1, most / 4))) {}

    class Lease {
      public:
        Lease(PostgresPool& pool, std::unique_ptr<PostgresConnection> connection, Use use)
            : pool_(pool), connection_(std::move(connection)), use_(use) {}
        ~Lease() { pool_.giveBack(std::move(connection_), use_); }
        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;
        PostgresConnection& operator*() const { return *connection_; }
        PostgresConnection* operator->() const { return connection_.get(); }

      private:
        PostgresPool& pool_;
        std::unique_ptr<PostgresConnection> connection_;
        const Use use_;
    };

    /// Waits until one is free, or there may be another, for as long as the database may take to answer. Who
    /// asks first for the same use gets one first. Throws Failure kUnavailable.
    Lease acquire(Use use) { return acquire(use, Clock::now() + address_.patience); }
    Lease acquire(Use use, Clock::time_point until);
    /// Closes those that nobody has: after one was found broken the others are, too.
    void closeIdle();
    /// How long the database may take to answer.
    [[nodiscard]] std::chrono::milliseconds patience() const noexcept { return address_.patience; }

  private:
    using Queue = std::list<std::monostate>;

    void wait(std::unique_lock<std::mutex>& lock, Use use, Clock::time_point until);
    void giveBack(std::unique_ptr<PostgresConnection> connection, Use use) noexcept;

    PostgresAddress address_;
    const StatementTexts& texts_;
    std::mutex mutex_;
    std::condition_variable freed_;
    Queue readers_;   ///< those who wait, in order
    Queue writers_;   ///< the same
    int left_;        ///< connections that may still be opened
    int writesLeft_;  ///< that may be lent to writes now
    std::vector<std::unique_ptr<PostgresConnection>> free_;
};

}  // namespace shapedb::store
