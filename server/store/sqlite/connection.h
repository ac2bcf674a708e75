// SPDX-License-Identifier: GPL-3.0-or-later
// The private layer over the SQLite C API. Functions throw Failure (server/store/failure.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "core/base/run_context.h"
#include "server/store/sql/connection.h"

struct sqlite3;
struct sqlite3_stmt;

namespace shapedb::store {

enum class OpenMode {
    kReadOnly,
    kReadWrite,        ///< the file must exist
    kReadWriteCreate,  ///< created when missing
};

/// One open database handle with its prepared statements.
class SqliteConnection final : public Connection {
  public:
    /// Opens `path` (":memory:" for a private database) and configures the connection before it reads a
    /// byte. Touches no content.
    SqliteConnection(const std::string& path, OpenMode mode, int busyTimeoutMs);
    ~SqliteConnection() override;
    SqliteConnection(const SqliteConnection&) = delete;
    SqliteConnection& operator=(const SqliteConnection&) = delete;

    PreparedStatement& prepared(const char* sql) override;
    void beginRead() override;
    void beginWrite() override;
    void commit() override;
    /// Needs no memory.
    void rollback() noexcept override;
    const char* withoutIndices(const char* sql) const noexcept override;
    void insertPoints(std::int64_t shapeId, std::uint64_t pointBytes, const BlobSource& blob) override;

    /// Runs one or more statements and ignores their rows.
    void execute(const std::string& sql);
    /// First column of the first row; the statement is not cached (PRAGMA ...).
    std::int64_t integer(const std::string& sql);
    std::string text(const std::string& sql);

    /// Rows changed by the last INSERT, UPDATE or DELETE, without triggers and cascades.
    std::int64_t changes() const noexcept;
    /// Of all statements so far, triggers and cascades included.
    std::int64_t totalChanges() const noexcept;
    std::int64_t lastInsertId() const noexcept;
    /// Writes the log back into the database and truncates it. Waits at most `waitMs` for readers; false
    /// when they kept it from finishing.
    bool truncateWal(int waitMs);

    /// Writes every byte of the log again, where it is, and syncs it. Nobody else may have the database open.
    void rewriteWal();

    sqlite3* handle() const noexcept { return db_; }
    /// `sql`, unless null, is the statement that failed: damage is reported with the tables it reads.
    [[noreturn]] void raiseLast(int code, const char* sql = nullptr) const;

  private:
    class CachedStatement;
    struct StatementCloser {
        void operator()(sqlite3_stmt* statement) const noexcept;
    };
    using StatementPtr = std::unique_ptr<sqlite3_stmt, StatementCloser>;

    void closeAll() noexcept;

    sqlite3* db_ = nullptr;
    int busyTimeoutMs_ = 0;
    // By address: the SQL texts are constants, each prepared once.
    std::unordered_map<const char*, std::unique_ptr<CachedStatement>> statements_;
    StatementPtr rollback_;
};

/// Runs `body`; damage that it meets is reported with `remedy` in place of what helps a database that is
/// served.
template <typename Body>
auto withRemedy(const std::string& remedy, Body&& body) {
    try {
        return body();
    } catch (Failure& failure) {
        std::string& message = failure.error.message;
        if (failure.fromDatabase && failure.error.code == ErrorCode::kDataLoss) {
            message.erase(std::min(message.find("; run "), message.size()));
            message += "; " + remedy;
        }
        throw;
    }
}

/// While it lives, `context` can interrupt a statement that runs on `connection` (Failure kCancelled).
class Interruptible {
  public:
    Interruptible(SqliteConnection& connection, const RunContext& context);
    ~Interruptible();
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;

  private:
    SqliteConnection& connection_;
};

/// SQLite's backup: all pages of `from` replace those of `to` in one transaction. Destroyed early, it
/// leaves `to` unchanged. Do not use either connection meanwhile.
class PageCopy {
  public:
    PageCopy(SqliteConnection& from, SqliteConnection& to);
    ~PageCopy();
    PageCopy(const PageCopy&) = delete;
    PageCopy& operator=(const PageCopy&) = delete;

    /// Copies up to `pages`; true when the copy is complete and committed.
    bool step(int pages);
    std::uint64_t donePages() const noexcept;
    std::uint64_t totalPages() const noexcept;

  private:
    SqliteConnection& to_;
    void* backup_;
};

/// Copies `stepPages` at a time and calls `between(done, total)` after each step but the last; if that
/// throws, `to` stays unchanged.
template <typename Between>
void copyDatabase(SqliteConnection& from, SqliteConnection& to, int stepPages, Between between) {
    PageCopy copy(from, to);
    bool finished = false;
    while (!finished) {
        finished = copy.step(stepPages);
        if (!finished) between(copy.donePages(), copy.totalPages());
    }
}

}  // namespace shapedb::store
