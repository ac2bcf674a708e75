// The private layer over the SQLite C API: connection, cached statements, transactions.
//
// Inside server/store/ failures travel as the exception `Failure`; every public function of
// the store catches it at the border (`guarded`) and returns its Error. That keeps SQL code
// in straight lines and rolls transactions back on every way out.
//
// Thread-safety: a connection and what belongs to it is used by one thread at a time.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "core/base/error.h"
#include "core/base/run_context.h"

struct sqlite3;
struct sqlite3_blob;
struct sqlite3_stmt;

namespace shapedb::store {

/// Thrown inside the store only. `fromSqlite`: the message is SQLite's and wants the name of
/// the operation in front.
struct Failure : std::exception {
    Failure(ErrorCode code, std::string message, bool fromLibrary = false)
        : error{code, std::move(message)}, fromSqlite(fromLibrary) {}
    const char* what() const noexcept override { return error.message.c_str(); }

    Error error;
    bool fromSqlite;
};

[[noreturn]] inline void raise(ErrorCode code, std::string message) {
    throw Failure(code, std::move(message));
}

/// The value, or the error as a Failure.
template <typename T>
T orRaise(Result<T> result) {
    if (!result) raise(result.error().code, result.error().message);
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// Runs the body of a public function and turns every exception into an Error. `operation`
/// completes "cannot ...".
template <typename Fn>
auto guarded(const char* operation, Fn&& body) noexcept -> Result<std::invoke_result_t<Fn>> {
    try {
        if constexpr (std::is_void_v<std::invoke_result_t<Fn>>) {
            body();
            return {};
        } else {
            return body();
        }
    } catch (const Failure& failure) {
        if (!failure.fromSqlite) return fail(failure.error);
        return fail(failure.error.code, std::string("cannot ") + operation + ": " + failure.error.message);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "out of memory");  // fits without allocating
    } catch (const std::exception& other) {
        return fail(ErrorCode::kInternal, std::string("cannot ") + operation + ": " + other.what());
    }
}

enum class OpenMode {
    kReadOnly,
    kReadWrite,        ///< the file must exist
    kReadWriteCreate,  ///< created when missing
};

/// One open database handle with its prepared statements.
class Connection {
  public:
    /// Opens `path` (":memory:" for a private one) and sets what every connection needs
    /// before it reads a byte. Touches no content. Throws Failure.
    Connection(const std::string& path, OpenMode mode, int busyTimeoutMs);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    /// Runs SQL text that returns no rows the caller wants; several statements are allowed.
    void execute(const std::string& sql);
    /// First column of the first row of a statement that is not cached (PRAGMA ...).
    std::int64_t integer(const std::string& sql);
    std::string text(const std::string& sql);

    /// Ends any transaction without throwing.
    void rollback() noexcept;
    /// Rows changed by the last INSERT, UPDATE or DELETE, triggers and cascades not counted.
    std::int64_t changes() const noexcept;
    std::int64_t lastInsertId() const noexcept;
    /// Writes the WAL back and truncates it, waiting for readers at most `waitMs`. Returns
    /// false when readers kept it from finishing.
    bool truncateWal(int waitMs);

    sqlite3* handle() const noexcept { return db_; }
    [[noreturn]] void raiseLast(int code) const;

  private:
    friend class Query;
    struct StatementCloser {
        void operator()(sqlite3_stmt* statement) const noexcept;
    };
    using StatementPtr = std::unique_ptr<sqlite3_stmt, StatementCloser>;

    sqlite3_stmt* prepared(const char* sql);

    sqlite3* db_ = nullptr;
    int busyTimeoutMs_ = 0;
    // By address: the SQL texts are constants (sqlite_sql.h), each prepared once.
    std::unordered_map<const char*, StatementPtr> statements_;
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

/// One execution of a cached statement. `sql` must be one of the constants of sqlite_sql.h:
/// its address is the cache key. Two executions of the same text must not overlap.
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

    /// True: a row is there. False: finished.
    bool step();
    /// For statements without rows.
    void run();

    std::int64_t integer(int column) const;
    bool isNull(int column) const;
    std::string text(int column) const;
    /// Valid until the next step.
    BlobView blob(int column) const;

  private:
    template <typename Number, std::enable_if_t<std::is_integral_v<Number>, int> = 0>
    void bind(int position, Number value) {
        bindInteger(position, static_cast<std::int64_t>(value));
    }
    void bind(int position, const std::string& value);
    void bind(int position, BlobView value);
    void bind(int position, ZeroBlob value);
    void bindInteger(int position, std::int64_t value);
    void check(int code) const;

    Connection& connection_;
    sqlite3_stmt* statement_;
};

/// Fills a blob that was inserted as ZeroBlob, from its start to its end, so that it is never in memory
/// as a whole. Inside the transaction that inserted it.
class BlobWriter {
  public:
    /// Names must outlive this. Throws Failure.
    BlobWriter(Connection& connection, const char* table, const char* column, std::int64_t rowId);
    ~BlobWriter();
    BlobWriter(const BlobWriter&) = delete;
    BlobWriter& operator=(const BlobWriter&) = delete;

    /// Throws Failure, also when the blob is full.
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

/// While it lives, a statement running on `connection` is interrupted (Failure kCancelled)
/// when `context` says so.
class Interruptible {
  public:
    Interruptible(Connection& connection, const RunContext& context);
    ~Interruptible();
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;

  private:
    Connection& connection_;
};

/// SQLite's backup: all pages of `from` replace those of `to` in one transaction on `to`. Destroyed
/// before the end, it leaves `to` as it was. Neither connection may be used meanwhile.
class PageCopy {
  public:
    PageCopy(Connection& from, Connection& to);
    ~PageCopy();
    PageCopy(const PageCopy&) = delete;
    PageCopy& operator=(const PageCopy&) = delete;

    /// Copies up to `pages`; true when all are there and committed.
    bool step(int pages);
    std::uint64_t donePages() const noexcept;
    std::uint64_t totalPages() const noexcept;

  private:
    Connection& to_;
    void* backup_;
};

/// Copies `stepPages` at a time, calling `between(done, total)` after each step but the last;
/// when that throws, `to` is as before.
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
