// SPDX-License-Identifier: GPL-3.0-or-later
// The private layer over the SQLite C API: connections, cached statements, transactions. Functions
// throw Failure (server/store/failure.h).
//
// Thread-safety: a connection and everything that uses it belong to one thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "core/base/run_context.h"
#include "server/store/failure.h"

struct sqlite3;
struct sqlite3_blob;
struct sqlite3_stmt;

namespace shapedb::store {

enum class OpenMode {
    kReadOnly,
    kReadWrite,        ///< the file must exist
    kReadWriteCreate,  ///< created when missing
};

/// One open database handle with its prepared statements.
class Connection {
  public:
    /// Opens `path` (":memory:" for a private database) and configures the connection before it reads a
    /// byte. Touches no content.
    Connection(const std::string& path, OpenMode mode, int busyTimeoutMs);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    /// Runs one or more statements and ignores their rows.
    void execute(const std::string& sql);
    /// First column of the first row; the statement is not cached (PRAGMA ...).
    std::int64_t integer(const std::string& sql);
    std::string text(const std::string& sql);

    /// Ends the open transaction, if there is one. Needs no memory.
    void rollback() noexcept;
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
    friend class Query;
    struct StatementCloser {
        void operator()(sqlite3_stmt* statement) const noexcept;
    };
    using StatementPtr = std::unique_ptr<sqlite3_stmt, StatementCloser>;

    sqlite3_stmt* prepared(const char* sql);
    void closeAll() noexcept;

    sqlite3* db_ = nullptr;
    int busyTimeoutMs_ = 0;
    // By address: the SQL texts are the constants of sql.h, each prepared once.
    std::unordered_map<const char*, StatementPtr> statements_;
    StatementPtr rollback_;
};

/// A blob bound without a copy: the bytes must outlive the query.
struct BlobView {
    const void* data = nullptr;
    std::size_t size = 0;
};

/// A blob of zeros that takes no memory, to be filled by a BlobWriter.
struct ZeroBlob {
    std::uint64_t size = 0;
};

/// One execution of a cached statement. `sql` must be a constant of sql.h: its address is the
/// cache key. Two executions of the same text must not overlap.
class Query {
  public:
    Query(Connection& connection, const char* sql);
    template <typename... Values>
    Query(Connection& connection, const char* sql, const Values&... values) : Query(connection, sql) {
        bindAll(values...);
    }
    ~Query();
    Query(const Query&) = delete;
    Query& operator=(const Query&) = delete;

    /// Binds the parameters ?1, ?2, ... in order.
    template <typename... Values>
    void bindAll(const Values&... values) {
        int position = 0;
        (bind(++position, values), ...);
    }

    /// True: there is a row. False: finished.
    bool step();
    /// For statements without rows.
    void run();

    std::int64_t integer(int column) const;
    double real(int column) const;
    bool isNull(int column) const;
    std::string text(int column) const;
    /// Valid until the next step.
    BlobView blob(int column) const;

  private:
    template <typename Number, std::enable_if_t<std::is_integral_v<Number>, int> = 0>
    void bind(int position, Number value) {
        bindInteger(position, static_cast<std::int64_t>(value));
    }
    void bind(int position, double value);
    void bind(int position, const std::string& value);
    void bind(int position, BlobView value);
    void bind(int position, ZeroBlob value);
    void bindInteger(int position, std::int64_t value);
    void check(int code) const;

    Connection& connection_;
    sqlite3_stmt* statement_;
};

/// Fills a blob inserted as ZeroBlob from start to end, so that SQLite never holds it whole. Use it
/// inside the transaction that inserted the blob.
class BlobWriter {
  public:
    /// The names must outlive this.
    BlobWriter(Connection& connection, const char* table, const char* column, std::int64_t rowId);
    ~BlobWriter();
    BlobWriter(const BlobWriter&) = delete;
    BlobWriter& operator=(const BlobWriter&) = delete;

    /// Throws Failure also when the blob is full.
    void append(const void* data, std::size_t size);

  private:
    Connection& connection_;
    sqlite3_blob* blob_ = nullptr;
    int at_ = 0;
};

/// BEGIN IMMEDIATE (or a read snapshot) ... COMMIT; rolls back when not committed.
class Transaction {
  public:
    enum class Kind { kRead, kWrite };
    Transaction(Connection& connection, Kind kind);
    ~Transaction();
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;

    void commit();

  private:
    Connection& connection_;
    bool open_ = true;
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
    Interruptible(Connection& connection, const RunContext& context);
    ~Interruptible();
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;

  private:
    Connection& connection_;
};

/// SQLite's backup: all pages of `from` replace those of `to` in one transaction. Destroyed early, it
/// leaves `to` unchanged. Do not use either connection meanwhile.
class PageCopy {
  public:
    PageCopy(Connection& from, Connection& to);
    ~PageCopy();
    PageCopy(const PageCopy&) = delete;
    PageCopy& operator=(const PageCopy&) = delete;

    /// Copies up to `pages`; true when the copy is complete and committed.
    bool step(int pages);
    std::uint64_t donePages() const noexcept;
    std::uint64_t totalPages() const noexcept;

  private:
    Connection& to_;
    void* backup_;
};

/// Copies `stepPages` at a time and calls `between(done, total)` after each step but the last; if that
/// throws, `to` stays unchanged.
template <typename Between>
void copyDatabase(Connection& from, Connection& to, int stepPages, Between between) {
    PageCopy copy(from, to);
    bool finished = false;
    while (!finished) {
        finished = copy.step(stepPages);
        if (!finished) between(copy.donePages(), copy.totalPages());
    }
}

}  // namespace shapedb::store
