// SPDX-License-Identifier: GPL-3.0-or-later
// A connection to a database of some kind, as the SQL that all kinds share sees it: cached statements,
// transactions. Functions throw Failure (server/store/failure.h).
//
// Thread-safety: a connection and everything that uses it belong to one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>

#include "server/store/failure.h"

namespace shapedb::store {

/// A blob bound without a copy: the bytes must outlive the query.
struct BlobView {
    const void* data = nullptr;
    std::size_t size = 0;
};
inline BlobView viewOf(const std::string& bytes) { return {bytes.data(), bytes.size()}; }
/// The bytes, copied.
inline std::string bytesOf(const BlobView& blob) {
    return {static_cast<const char*>(blob.size > 0 ? blob.data : ""), blob.size};
}

/// A blob that is bound as NULL if it is empty.
struct BlobOrNull {
    BlobView blob;
};

/// A blob that may be too large to be in memory.
struct BlobSource {
    using Sink = std::function<void(const void* data, std::size_t size)>;
    std::uint64_t size = 0;
    const std::string* whole = nullptr;  ///< not owned; null: it has to be written in pieces
    /// Calls the sink with pieces that add up to `size` bytes.
    std::function<void(const Sink&)> write{};
};

/// A prepared statement, owned by its connection. Use it through Query.
class PreparedStatement {
  public:
    virtual ~PreparedStatement() = default;

    // Positions count from 1, as ?1, ?2, ... do; columns from 0.
    virtual void bindInteger(int position, std::int64_t value) = 0;
    virtual void bindReal(int position, double value) = 0;
    /// Copies it.
    virtual void bindText(int position, const std::string& value) = 0;
    virtual void bindBlob(int position, BlobView value) = 0;
    virtual void bindNull(int position) = 0;

    /// True: there is a row. False: finished.
    virtual bool step() = 0;
    virtual std::int64_t integer(int column) const = 0;
    virtual double real(int column) const = 0;
    virtual bool isNull(int column) const = 0;
    /// Empty for NULL.
    virtual std::string text(int column) const = 0;
    /// Valid until the next step.
    virtual BlobView blob(int column) const = 0;

    /// Ends the execution and forgets what was bound.
    virtual void reset() noexcept = 0;
};

class Connection {
  public:
    virtual ~Connection() = default;

    /// The statement of this text, prepared at its first use. The key is the address of the text: a constant.
    virtual PreparedStatement& prepared(const char* sql) = 0;
    virtual void beginRead() = 0;
    /// Takes the locks that a write needs before it reads.
    virtual void beginWrite() = 0;
    virtual void commit() = 0;
    /// Ends the open transaction, if there is one.
    virtual void rollback() noexcept = 0;
    /// A statement that finds the same as `sql` when an index that it reads is damaged; null if there is
    /// none.
    virtual const char* withoutIndices(const char* sql) const noexcept {
        static_cast<void>(sql);
        return nullptr;
    }
    /// Stores the points of a shape that has none; `pointBytes` is their size uncompressed. Each kind of
    /// database keeps large blobs in its own way.
    virtual void insertPoints(std::int64_t shapeId, std::uint64_t pointBytes, const BlobSource& blob) = 0;
};

/// One execution of a cached statement. `sql` must be a constant: its address is the cache key. Two
/// executions of the same text must not overlap.
class Query {
  public:
    Query(Connection& connection, const char* sql) : statement_(connection.prepared(sql)) {}
    template <typename... Values>
    Query(Connection& connection, const char* sql, const Values&... values) : Query(connection, sql) {
        bindAll(values...);
    }
    ~Query() { statement_.reset(); }
    Query(const Query&) = delete;
    Query& operator=(const Query&) = delete;

    /// Binds the parameters ?1, ?2, ... in order.
    template <typename... Values>
    void bindAll(const Values&... values) {
        int position = 0;
        (bind(++position, values), ...);
    }

    /// The same for a single one, where their number is not known before.
    template <typename Value>
    void bindAt(int position, const Value& value) {
        bind(position, value);
    }
    void bindNullAt(int position) { statement_.bindNull(position); }

    /// True: there is a row. False: finished.
    bool step() { return statement_.step(); }
    /// For statements without rows.
    void run() {
        while (step()) {
        }
    }

    std::int64_t integer(int column) const { return statement_.integer(column); }
    double real(int column) const { return statement_.real(column); }
    bool isNull(int column) const { return statement_.isNull(column); }
    std::string text(int column) const { return statement_.text(column); }
    /// Valid until the next step.
    BlobView blob(int column) const { return statement_.blob(column); }

  private:
    template <typename Number, std::enable_if_t<std::is_integral_v<Number>, int> = 0>
    void bind(int position, Number value) {
        statement_.bindInteger(position, static_cast<std::int64_t>(value));
    }
    void bind(int position, double value) { statement_.bindReal(position, value); }
    void bind(int position, const std::string& value) { statement_.bindText(position, value); }
    void bind(int position, BlobView value) { statement_.bindBlob(position, value); }
    void bind(int position, const BlobOrNull& value) {
        if (value.blob.size > 0) {
            statement_.bindBlob(position, value.blob);
        } else {
            statement_.bindNull(position);
        }
    }

    PreparedStatement& statement_;
};

/// A read snapshot, or a write transaction; rolls back when not committed.
class Transaction {
  public:
    enum class Kind { kRead, kWrite };
    Transaction(Connection& connection, Kind kind) : connection_(connection) {
        connection.rollback();  // one that could not be ended, as a last resort
        if (kind == Kind::kWrite) {
            connection.beginWrite();
        } else {
            connection.beginRead();
        }
    }
    ~Transaction() {
        if (open_) connection_.rollback();
    }
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;

    /// When this throws, the transaction is still open and the destructor rolls it back.
    void commit() {
        connection_.commit();
        open_ = false;
    }

  private:
    Connection& connection_;
    bool open_ = true;
};

/// Calls `look(sql)`; where that meets damage, which may be that of an index, with the statement that needs
/// none.
template <typename Look>
void lookUp(Connection& connection, const char* sql, Look look) {
    try {
        return look(sql);
    } catch (const Failure& failure) {
        if (failure.error.code != ErrorCode::kDataLoss || connection.withoutIndices(sql) == nullptr) throw;
    }
    look(connection.withoutIndices(sql));
}

/// The only number that the query finds, 0 if it finds none.
inline std::int64_t numberOf(Query&& query) { return query.step() ? query.integer(0) : 0; }

}  // namespace shapedb::store
