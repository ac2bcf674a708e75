// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/connection.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include <libpq-fe.h>
#include <poll.h>

namespace shapedb::store {

namespace {

using Clock = std::chrono::steady_clock;

// Types of the database, as in its catalogue.
constexpr Oid kBool = 16, kBytea = 17, kInt8 = 20, kInt2 = 21, kInt4 = 23, kFloat8 = 701;

/// What the database takes for a time.
constexpr std::int64_t kLongestLockMs = 2'147'483'647;

constexpr int kBinary = 1;
/// Rows that are in memory at a time, of statements that may find any number.
constexpr int kRowsAtATime = 256;
/// The largest piece of a scan in one row.
constexpr std::size_t kChunkBytes = std::size_t{8} << 20;

constexpr char kInsertPoints[] =
    "INSERT INTO shape_points (shape_id, point_bytes, stored_bytes) VALUES (?1, ?2, ?3)";
constexpr char kInsertChunk[] = "INSERT INTO point_chunk (shape_id, number, bytes) VALUES (?1, ?2, ?3)";
constexpr char kBeginRead[] = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY";
constexpr char kBeginWrite[] = "BEGIN ISOLATION LEVEL READ COMMITTED READ WRITE";
constexpr char kConflict[] = "another transaction was in the way (SQLSTATE ";
constexpr char kHeldUp[] = "another transaction has held up this one in the database for too long (SQLSTATE ";
constexpr char kLockTimeoutState[] = "55P03";

/// Before the state in the messages of conflicts: see isConflict.
bool isConflictState(const std::string& state) { return state == "40001" || state == "40P01"; }

ErrorCode codeOf(const std::string& state) {
    if (state == "53100") return ErrorCode::kStorageFull;
    if (state == "53200") return ErrorCode::kOutOfMemory;
    if (state == "57014") return ErrorCode::kCancelled;
    if (state == "XX001" || state == "XX002") return ErrorCode::kDataLoss;
    if (state == "25006") return ErrorCode::kUnavailable;  // a standby
    if (state == "25P03") return ErrorCode::kUnavailable;  // its transaction was idle for too long
    if (state == kLockTimeoutState) return ErrorCode::kUnavailable;
    const std::string kind = state.substr(0, 2);
    // No connection; too many of them; shut down, or starting.
    if (kind == "08" || kind == "53" || kind == "57" || kind == "40") return ErrorCode::kUnavailable;
    // The store checks before it writes, so a broken constraint is its own mistake.
    if (kind == "22" || kind == "23" || kind == "42") return ErrorCode::kInternal;
    return ErrorCode::kStorage;
}

std::string trimmed(const char* message) {
    std::string text = message != nullptr ? message : "";
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.pop_back();
    for (const char blank : {'\n', '\t'}) std::replace(text.begin(), text.end(), blank, ' ');
    return text;
}

/// ?1 as $1. No text of ours has a question mark elsewhere.
std::string withDollars(std::string sql) {
    std::replace(sql.begin(), sql.end(), '?', '$');
    return sql;
}

bool mayFindMany(const std::string& sql) {
    const bool isLocking = sql.find("FOR UPDATE") != std::string::npos;
    return sql.rfind("SELECT", 0) == 0 && sql.find("ORDER BY") != std::string::npos && !isLocking;
}

std::string bigEndian(std::uint64_t value, std::size_t bytes) {
    std::string text(bytes, '\0');
    for (std::size_t i = bytes; i-- > 0; value >>= 8) text[i] = static_cast<char>(value & 0xff);
    return text;
}

std::uint64_t fromBigEndian(const char* data, int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value = value << 8 | static_cast<unsigned char>(data[i]);
    return value;
}

}  // namespace

bool isConflict(const Failure& failure) noexcept { return failure.error.message.rfind(kConflict, 0) == 0; }

bool isHeldUp(const Failure& failure) noexcept { return failure.error.message.rfind(kHeldUp, 0) == 0; }

void PostgresConnection::ResultCloser::operator()(pg_result* result) const noexcept { PQclear(result); }

// One execution: parameters in the binary form of the types that the database has told, rows of at most
// kRowsAtATime where there may be many.
class PostgresConnection::CachedStatement final : public PreparedStatement {
  public:
    CachedStatement(PostgresConnection& connection, std::string name, bool isCursor,
                    std::vector<Oid> parameterTypes)
        : connection_(connection),
          name_(std::move(name)),
          isCursor_(isCursor),
          fetch_("FETCH " + std::to_string(kRowsAtATime) + " FROM c" + name_),
          types_(std::move(parameterTypes)),
          values_(types_.size()) {}

    void bindInteger(int position, std::int64_t value) override {
        const auto bits = static_cast<std::uint64_t>(value);
        switch (typeOf(position)) {
            case kInt8: return keep(position, bigEndian(bits, 8));
            case kInt4: return keep(position, bigEndian(bits, 4));
            case kInt2: return keep(position, bigEndian(bits, 2));
            case kBool: return keep(position, std::string(1, value != 0 ? '\1' : '\0'));
            case kFloat8: return bindReal(position, static_cast<double>(value));
            default: raise(ErrorCode::kInternal, "a number is bound to a parameter of another type");
        }
    }
    void bindReal(int position, double value) override {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof bits);
        keep(position, bigEndian(bits, sizeof bits));
    }
    void bindText(int position, const std::string& value) override { keep(position, value); }
    void bindBlob(int position, BlobView value) override {
        Value& slot = at(position);
        slot = {};
        // A null pointer would be NULL instead of an empty blob.
        slot.view = {value.data != nullptr ? value.data : "", value.size};
        slot.isBound = true;
    }
    void bindNull(int position) override { at(position) = {}; }

    bool step() override {
        if (!isRunning_) {
            start();
        } else {
            ++row_;
        }
        if (row_ < rowCount()) return true;
        if (!isCursor_ || rowCount() < kRowsAtATime) return false;
        fetch();
        return row_ < rowCount();
    }

    std::int64_t integer(int column) const override {
        if (isNull(column)) return 0;
        const int bytes = PQgetlength(rows_.get(), row_, column);
        const std::uint64_t bits = fromBigEndian(PQgetvalue(rows_.get(), row_, column), bytes);
        switch (PQftype(rows_.get(), column)) {
            case kInt8: return static_cast<std::int64_t>(bits);
            case kInt4: return static_cast<std::int32_t>(bits);
            case kInt2: return static_cast<std::int16_t>(bits);
            case kBool: return static_cast<std::int64_t>(bits);
            default: raise(ErrorCode::kInternal, "a column of another type is read as a number");
        }
    }
    double real(int column) const override {
        if (isNull(column)) return 0;
        if (PQftype(rows_.get(), column) != kFloat8) return static_cast<double>(integer(column));
        const std::uint64_t bits = fromBigEndian(PQgetvalue(rows_.get(), row_, column), 8);
        double value = 0;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
    bool isNull(int column) const override { return PQgetisnull(rows_.get(), row_, column) != 0; }
    std::string text(int column) const override {
        switch (PQftype(rows_.get(), column)) {
            case kInt8:
            case kInt4:
            case kInt2: return isNull(column) ? std::string() : std::to_string(integer(column));
            default: return bytesOf(blob(column));
        }
    }
    BlobView blob(int column) const override {
        if (isNull(column)) return {};
        return {PQgetvalue(rows_.get(), row_, column),
                static_cast<std::size_t>(PQgetlength(rows_.get(), row_, column))};
    }

    void reset() noexcept override {
        rows_.reset();
        for (Value& value : values_) value = {};
        // The cursor of a transaction that failed is gone with it.
        if (isRunning_ && isCursor_ && PQtransactionStatus(connection_.connection_) == PQTRANS_INTRANS) {
            static_cast<void>(guarded("close a cursor", [&] { connection_.execute("CLOSE c" + name_); }));
        }
        isRunning_ = false;
    }

  private:
    struct Value {
        std::string kept;
        std::optional<BlobView> view;  ///< not owned, in place of `kept`
        bool isBound = false;          ///< false: NULL
    };

    Value& at(int position) {
        if (position < 1 || static_cast<std::size_t>(position) > values_.size()) {
            raise(ErrorCode::kInternal, "the statement has no parameter " + std::to_string(position));
        }
        return values_[static_cast<std::size_t>(position - 1)];
    }
    Oid typeOf(int position) {
        static_cast<void>(at(position));
        return types_[static_cast<std::size_t>(position - 1)];
    }
    void keep(int position, std::string bytes) {
        Value& slot = at(position);
        slot = {};
        slot.kept = std::move(bytes);
        slot.isBound = true;
    }
    int rowCount() const { return rows_ == nullptr ? 0 : PQntuples(rows_.get()); }

    void start() {
        std::vector<const char*> data;
        std::vector<int> sizes;
        for (const Value& value : values_) {
            const BlobView view = value.view.value_or(viewOf(value.kept));
            data.push_back(value.isBound ? static_cast<const char*>(view.data) : nullptr);
            sizes.push_back(static_cast<int>(view.size));
        }
        const std::vector<int> formats(values_.size(), kBinary);
        if (PQsendQueryPrepared(connection_.connection_, name_.c_str(), static_cast<int>(values_.size()),
                                data.data(), sizes.data(), formats.data(), kBinary) == 0) {
            connection_.raiseConnection("send a statement");
        }
        rows_ = connection_.await();
        row_ = 0;
        isRunning_ = true;
        if (isCursor_) fetch();
    }

    void fetch() {
        if (PQsendQueryParams(connection_.connection_, fetch_.c_str(), 0, nullptr, nullptr, nullptr, nullptr,
                              kBinary) == 0) {
            connection_.raiseConnection("fetch rows");
        }
        rows_ = connection_.await();
        row_ = 0;
    }

    PostgresConnection& connection_;
    std::string name_;
    bool isCursor_;
    std::string fetch_;
    std::vector<Oid> types_;
    std::vector<Value> values_;
    ResultPtr rows_;
    int row_ = 0;
    bool isRunning_ = false;
};

PostgresConnection::PostgresConnection(const PostgresAddress& address, const StatementTexts& texts)
    : texts_(texts), patience_(address.patience) {
    const auto seconds =
        std::max<std::int64_t>(1, std::chrono::duration_cast<std::chrono::seconds>(patience_).count());
    const std::string timeout = std::to_string(seconds);
    // The database ends a wait for a lock before this side gives up: a transaction of which nobody knows any
    // more would go on waiting there, and one more for each call that is tried again.
    const auto lockMs = std::max<std::int64_t>(1, patience_.count() - patience_.count() / 10);
    // What is read to an end is not worth compiling, and the first rows of a page still less.
    const std::string session =
        "-c search_path=public -c timezone=UTC -c extra_float_digits=3 -c jit=off "
        "-c lock_timeout=" +
        std::to_string(std::min(lockMs, kLongestLockMs));
    std::vector<std::pair<const char*, const char*>> options = {
        // The URI may say otherwise: what comes before it is for what it does not mention.
        {"connect_timeout", timeout.c_str()},
        // A host that has gone without a word is noticed while the connection is idle, too.
        {"keepalives_idle", "10"},
        {"keepalives_interval", "5"},
        {"keepalives_count", "3"},
        {"dbname", address.uri.c_str()},
        {"application_name", address.serverName.c_str()},
        {"client_encoding", "UTF8"},
        {"options", session.c_str()},
    };
    if (!address.password.empty()) options.emplace_back("password", address.password.c_str());
    std::vector<const char*> names;
    std::vector<const char*> values;
    for (const auto& [name, value] : options) {
        names.push_back(name);
        values.push_back(value);
    }
    names.push_back(nullptr);
    values.push_back(nullptr);
    constexpr int kExpandUri = 1;
    connection_ = PQconnectdbParams(names.data(), values.data(), kExpandUri);
    if (connection_ == nullptr) throw std::bad_alloc();
    if (PQstatus(connection_) != CONNECTION_OK || PQsetnonblocking(connection_, 1) != 0) {
        const std::string why = trimmed(PQerrorMessage(connection_));
        PQfinish(connection_);
        throw Failure(ErrorCode::kUnavailable, "the database cannot be reached: " + why, false);
    }
    // Warnings and notices are for people at a terminal.
    PQsetNoticeReceiver(
        connection_, [](void*, const PGresult*) {}, nullptr);
}

PostgresConnection::~PostgresConnection() {
    statements_.clear();
    PQfinish(connection_);
}

bool PostgresConnection::isBroken() const noexcept {
    return timedOut_ || PQstatus(connection_) != CONNECTION_OK ||
           PQtransactionStatus(connection_) == PQTRANS_UNKNOWN;
}

void PostgresConnection::raiseConnection(const std::string& what) const {
    throw Failure(
        ErrorCode::kUnavailable,
        "the connection to the database failed (" + what + "): " + trimmed(PQerrorMessage(connection_)),
        false);
}

void PostgresConnection::raiseResult(const pg_result* result) const {
    const char* field = PQresultErrorField(result, PG_DIAG_SQLSTATE);
    const std::string state = field != nullptr ? field : "";
    const std::string primary = trimmed(PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY));
    if (state.empty()) {
        throw Failure(ErrorCode::kUnavailable,
                      "the connection to the database failed: " + trimmed(PQresultErrorMessage(result)),
                      false);
    }
    if (isConflictState(state)) throw Failure(ErrorCode::kUnavailable, kConflict + state + ")", false);
    const ErrorCode code = codeOf(state);
    if (state == kLockTimeoutState) {
        raise(code, kHeldUp + state + ")");
    }
    throw Failure(code, "the database says: " + primary + " (SQLSTATE " + state + ")", true);
}

void PostgresConnection::waitForSocket(bool writable, Clock::time_point until) {
    while (true) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
        if (left <= 0) {
            timedOut_ = true;
            raise(ErrorCode::kUnavailable,
                  "the database has not answered for " + std::to_string(patience_.count() / 1000) + " s");
        }
        pollfd entry{PQsocket(connection_), static_cast<short>(writable ? POLLIN | POLLOUT : POLLIN), 0};
        const int ready = ::poll(&entry, 1, static_cast<int>(std::min<std::int64_t>(left, 1'000)));
        if (ready > 0) return;
        if (ready < 0 && errno != EINTR) raiseConnection("wait");
    }
}

void PostgresConnection::flush(Clock::time_point until) {
    while (true) {
        const int left = PQflush(connection_);
        if (left == 0) return;
        if (left < 0) raiseConnection("send");
        waitForSocket(true, until);
        if (PQconsumeInput(connection_) == 0) raiseConnection("receive");
    }
}

PostgresConnection::ResultPtr PostgresConnection::await() {
    const auto until = Clock::now() + patience_;
    flush(until);
    ResultPtr last;
    ResultPtr failed;
    while (true) {
        while (PQisBusy(connection_) != 0) {
            waitForSocket(false, until);
            if (PQconsumeInput(connection_) == 0) raiseConnection("receive");
        }
        ResultPtr next(PQgetResult(connection_));
        if (next == nullptr) break;
        const auto status = PQresultStatus(next.get());
        const bool ok =
            status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK || status == PGRES_EMPTY_QUERY;
        if (!ok && failed == nullptr) failed = std::move(next);
        if (ok) last = std::move(next);
        if (PQstatus(connection_) != CONNECTION_OK) break;
    }
    if (failed != nullptr) raiseResult(failed.get());
    if (last == nullptr) raiseConnection("receive");
    return last;
}

void PostgresConnection::execute(const std::string& sql) {
    if (PQsendQuery(connection_, sql.c_str()) == 0) raiseConnection("send a statement");
    static_cast<void>(await());
}

std::string PostgresConnection::text(const std::string& sql) {
    if (PQsendQuery(connection_, sql.c_str()) == 0) raiseConnection("send a statement");
    const ResultPtr rows = await();
    if (PQntuples(rows.get()) == 0 || PQgetisnull(rows.get(), 0, 0) != 0) return {};
    return PQgetvalue(rows.get(), 0, 0);
}

PreparedStatement& PostgresConnection::prepared(const char* sql) {
    const auto found = statements_.find(sql);
    if (found != statements_.end()) return *found->second;
    const auto own = texts_.find(sql);
    const std::string text = withDollars(own != texts_.end() ? own->second : sql);
    const std::string name = "s" + std::to_string(statements_.size());
    const bool isCursor = mayFindMany(text);
    const std::string all = isCursor ? "DECLARE c" + name + " NO SCROLL CURSOR FOR " + text : text;
    if (PQsendPrepare(connection_, name.c_str(), all.c_str(), 0, nullptr) == 0) raiseConnection("prepare");
    static_cast<void>(await());
    if (PQsendDescribePrepared(connection_, name.c_str()) == 0) raiseConnection("prepare");
    const ResultPtr described = await();
    std::vector<Oid> types;
    for (int i = 0; i < PQnparams(described.get()); ++i) types.push_back(PQparamtype(described.get(), i));
    auto statement = std::make_unique<CachedStatement>(*this, name, isCursor, std::move(types));
    return *statements_.emplace(sql, std::move(statement)).first->second;
}

void PostgresConnection::beginRead() { execute(kBeginRead); }

void PostgresConnection::beginWrite() {
    std::string begin = kBeginWrite;
    if (lockPatience_.count() > 0)
        begin += "; SET LOCAL lock_timeout = " + std::to_string(lockPatience_.count());
    execute(begin);
}

void PostgresConnection::commit() {
    // The database would answer a COMMIT after an error by undoing all, without a word.
    if (PQtransactionStatus(connection_) != PQTRANS_INTRANS) {
        raise(ErrorCode::kInternal, "a transaction that failed is committed");
    }
    try {
        execute("COMMIT");
    } catch (const Failure& failure) {
        if (!isBroken()) throw;
        raise(ErrorCode::kUnavailable,
              "the connection to the database was lost while a change was being stored: it is stored or not; "
              "look before it is sent again (" +
                  failure.error.message + ")");
    }
}

void PostgresConnection::rollback() noexcept {
    if (isBroken() || PQtransactionStatus(connection_) == PQTRANS_IDLE) return;
    static_cast<void>(guarded("roll back", [&] { execute("ROLLBACK"); }));
}

void PostgresConnection::insertPoints(std::int64_t shapeId, std::uint64_t pointBytes,
                                      const BlobSource& blob) {
    Query(*this, kInsertPoints, shapeId, pointBytes, blob.size).run();
    std::int64_t number = 0;
    const auto insert = [&](const char* data, std::size_t size) {
        for (std::size_t at = 0; at < size; at += kChunkBytes) {
            const BlobView chunk{data + at, std::min(kChunkBytes, size - at)};
            Query(*this, kInsertChunk, shapeId, number++, chunk).run();
        }
    };
    if (blob.whole != nullptr) return insert(blob.whole->data(), blob.whole->size());
    std::string pending;
    blob.write([&](const void* data, std::size_t size) {
        pending.append(static_cast<const char*>(data), size);
        if (pending.size() < kChunkBytes) return;
        const std::size_t whole = pending.size() / kChunkBytes * kChunkBytes;
        insert(pending.data(), whole);
        pending.erase(0, whole);
    });
    insert(pending.data(), pending.size());
}

Result<void> checkUri(const std::string& uri) {
    char* why = nullptr;
    const std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)> parsed(
        PQconninfoParse(uri.c_str(), &why), PQconninfoFree);
    const std::unique_ptr<char, void (*)(void*)> message(why, PQfreemem);
    if (parsed == nullptr) {
        return fail(ErrorCode::kInvalidArgument, "the URI of the database cannot be read");
    }
    for (const PQconninfoOption* option = parsed.get(); option->keyword != nullptr; ++option) {
        const std::string keyword = option->keyword;
        const bool isSecret = keyword == "password" || keyword == "sslpassword";
        if (isSecret && option->val != nullptr && *option->val != '\0') {
            return fail(
                ErrorCode::kInvalidArgument,
                "the URI of the database holds a password: put it into a file (postgres.password_file), or "
                "into PGPASSWORD");
        }
    }
    return {};
}

}  // namespace shapedb::store
