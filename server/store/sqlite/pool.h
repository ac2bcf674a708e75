// SPDX-License-Identifier: GPL-3.0-or-later
// Read connections, each lent to one thread at a time.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/store/sqlite/connection.h"

namespace shapedb::store {

/// Thread-safe. Must outlive its leases.
class ReaderPool {
  public:
    /// Opens `count` connections. Throws Failure.
    ReaderPool(const std::string& path, int count, int busyTimeoutMs);

    class Lease {
      public:
        Lease(ReaderPool& pool, std::unique_ptr<SqliteConnection> connection)
            : pool_(pool), connection_(std::move(connection)) {}
        ~Lease() { pool_.giveBack(std::move(connection_)); }
        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;
        SqliteConnection& operator*() const { return *connection_; }

      private:
        ReaderPool& pool_;
        std::unique_ptr<SqliteConnection> connection_;
    };

    /// Waits until one is free.
    Lease acquire();

  private:
    void giveBack(std::unique_ptr<SqliteConnection> connection);

    std::mutex mutex_;
    std::condition_variable freed_;
    std::vector<std::unique_ptr<SqliteConnection>> free_;
};

}  // namespace shapedb::store
