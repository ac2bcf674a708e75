// SPDX-License-Identifier: GPL-3.0-or-later
// A connection to PostgreSQL as the SQL of all stores sees it. Functions throw Failure, as those of the link
// (link.h) do.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "server/store/postgres/link.h"
#include "server/store/sql/connection.h"

namespace shapedb::store {

/// What a kind of statement is called here when its text is not that of sql.h: by address of the shared text.
using StatementTexts = std::unordered_map<const char*, std::string>;

class PostgresConnection final : public Connection {
  public:
    /// `texts`, not owned, must outlive this.
    PostgresConnection(const PostgresAddress& address, const StatementTexts& texts)
        : texts_(texts), link_(address) {}

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

    [[nodiscard]] bool isBroken() const noexcept { return link_.isBroken(); }
    /// Broken because the database did not answer in time.
    [[nodiscard]] bool hasTimedOut() const noexcept { return link_.hasTimedOut(); }

  private:
    const StatementTexts& texts_;
    PostgresLink link_;
    std::chrono::milliseconds lockPatience_{0};
    std::unordered_map<const char*, std::unique_ptr<PreparedStatement>> statements_;
    int names_ = 0;  ///< that statements have
};

}  // namespace shapedb::store
