// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/connection.h"

#include <algorithm>
#include <cerrno>
#include <limits>
#include <string_view>
#include <vector>

#include <sqlite3.h>

namespace shapedb::store {

namespace {

constexpr char kBeginRead[] = "BEGIN";
// Takes the write lock at once. A transaction that reads first may be refused it later.
constexpr char kBeginWrite[] = "BEGIN IMMEDIATE";
constexpr char kCommit[] = "COMMIT";
constexpr char kRollback[] = "ROLLBACK";
// What a statement cannot be prepared without.
constexpr char kSchema[] = "FROM sqlite_schema";

// Virtual machine steps between two checks for cancellation: a few microseconds.
constexpr int kProgressSteps = 10000;

constexpr int kRewriteBytes = 1 << 20;

// EFBIG is the file size limit of the process, EDQUOT the user's quota: to the operator the same
// as a full device.
bool isFull(int systemError) {
    return systemError == ENOSPC || systemError == EFBIG || systemError == EDQUOT;
}

ErrorCode codeOf(int sqliteCode, bool full) {
    switch (sqliteCode & 0xff) {
        case SQLITE_FULL: return ErrorCode::kStorageFull;
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB:
        case SQLITE_FORMAT: return ErrorCode::kDataLoss;
        case SQLITE_NOMEM: return ErrorCode::kOutOfMemory;
        case SQLITE_INTERRUPT: return ErrorCode::kCancelled;
        case SQLITE_TOOBIG: return ErrorCode::kInvalidArgument;
        // The store checks before it writes, so a broken constraint is its own mistake.
        case SQLITE_CONSTRAINT:
        case SQLITE_MISUSE:
        case SQLITE_RANGE:
        case SQLITE_MISMATCH: return ErrorCode::kInternal;
        case SQLITE_IOERR:
            if (sqliteCode == SQLITE_IOERR_NOMEM) return ErrorCode::kOutOfMemory;
            if (sqliteCode == SQLITE_IOERR_CORRUPTFS) return ErrorCode::kDataLoss;
            return full ? ErrorCode::kStorageFull : ErrorCode::kStorage;
        case SQLITE_CANTOPEN: return full ? ErrorCode::kStorageFull : ErrorCode::kStorage;
        default: return ErrorCode::kStorage;
    }
}

/// Whether the last failure of the database file or its log was lack of space. The global errno no
/// longer tells: SQLite has rolled back since.
bool filesAreFull(sqlite3* db) {
    int last = 0;
    sqlite3_file_control(db, "main", SQLITE_FCNTL_LAST_ERRNO, &last);
    if (isFull(last)) return true;
    sqlite3_file* log = nullptr;
    sqlite3_file_control(db, "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
    if (log == nullptr || log->pMethods == nullptr) return false;
    last = 0;
    log->pMethods->xFileControl(log, SQLITE_FCNTL_LAST_ERRNO, &last);
    return isFull(last);
}

/// " in table shape or job": SQLite does not say of which table a damaged page is, but the statement names
/// those it can be of.
std::string tablesOf(std::string_view sql) {
    std::vector<std::string> tables;
    std::string before;
    for (std::size_t at = 0; at < sql.size();) {
        const std::size_t end = std::min(sql.find_first_of(" (),", at), sql.size());
        std::string word(sql.substr(at, end - at));
        at = end + 1;
        if (word.empty()) continue;
        const bool isTable = before == "FROM" || before == "JOIN" || before == "INTO" || before == "UPDATE";
        const bool isNew = std::find(tables.begin(), tables.end(), word) == tables.end();
        if (isTable && isNew && word != "SELECT" && word != "SET") tables.push_back(word);
        before = std::move(word);
    }
    std::string text;
    for (std::size_t i = 0; i < tables.size(); ++i) {
        text += i == 0 ? " in table " : i + 1 == tables.size() ? " or " : ", ";
        text += tables[i];
    }
    return text;
}

int openFlags(OpenMode mode) {
    switch (mode) {
        case OpenMode::kReadOnly: return SQLITE_OPEN_READONLY;
        case OpenMode::kReadWrite: return SQLITE_OPEN_READWRITE;
        case OpenMode::kReadWriteCreate: return SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
    }
    return SQLITE_OPEN_READONLY;
}

/// Empty for NULL. Fetching a number makes text of it: the memory for that may be missing.
std::string textOf(sqlite3* database, sqlite3_stmt* statement, int column) {
    // The text first: once it is converted, it has another size.
    const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
    const int size = sqlite3_column_bytes(statement, column);
    if (data == nullptr && sqlite3_errcode(database) == SQLITE_NOMEM) throw std::bad_alloc();
    return data == nullptr ? std::string() : std::string(data, static_cast<std::size_t>(size));
}

}  // namespace

void Connection::StatementCloser::operator()(sqlite3_stmt* statement) const noexcept {
    sqlite3_finalize(statement);
}

Connection::Connection(const std::string& path, OpenMode mode, int busyTimeoutMs)
    : busyTimeoutMs_(busyTimeoutMs) {
    // SQLite would read "file:..." as a URI with options.
    const std::string plain = path.rfind("file:", 0) == 0 ? "./" + path : path;
    const int code = sqlite3_open_v2(plain.c_str(), &db_, openFlags(mode) | SQLITE_OPEN_NOMUTEX, nullptr);
    try {
        if (code != SQLITE_OK) raiseLast(code);
        sqlite3_extended_result_codes(db_, 1);
        sqlite3_busy_timeout(db_, busyTimeoutMs);
        // DEFENSIVE keeps SQL from writing the schema table. The schema comes from the file:
        // without TRUSTED_SCHEMA it cannot call functions with side effects.
        sqlite3_db_config(db_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
        sqlite3_db_config(db_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
        execute("PRAGMA cell_size_check=ON; PRAGMA foreign_keys=ON; PRAGMA synchronous=FULL");
        // Now, for when it is needed there may be no memory.
        sqlite3_stmt* raw = nullptr;
        const int prepared = sqlite3_prepare_v3(db_, kRollback, -1, SQLITE_PREPARE_PERSISTENT, &raw, nullptr);
        rollback_.reset(raw);
        if (prepared != SQLITE_OK) raiseLast(prepared, kSchema);
    } catch (...) {
        closeAll();
        throw;
    }
}

Connection::~Connection() { closeAll(); }

void Connection::closeAll() noexcept {
    statements_.clear();
    rollback_.reset();
    sqlite3_close(db_);
}

void Connection::raiseLast(int code, const char* sql) const {
    if (db_ == nullptr) throw std::bad_alloc();
    const bool full =
        isFull(sqlite3_system_errno(db_)) || ((code & 0xff) == SQLITE_IOERR && filesAreFull(db_));
    std::string message = sqlite3_errmsg(db_);
    message += " (SQLite code " + std::to_string(code) + ")";
    const ErrorCode mapped = codeOf(code, full);
    if (mapped == ErrorCode::kStorageFull) message += "; free some space on the device";
    if (mapped == ErrorCode::kDataLoss) {
        if (sql != nullptr) message += tablesOf(sql);
        message += std::string("; ") + kDamageRemedy;
    }
    throw Failure(mapped, std::move(message), true);
}

void Connection::execute(const std::string& sql) {
    const int code = sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr);
    if (code != SQLITE_OK) raiseLast(code, sql.rfind("PRAGMA", 0) == 0 ? kSchema : sql.c_str());
}

std::int64_t Connection::integer(const std::string& sql) {
    const std::string value = text(sql);
    return value.empty() ? 0 : std::strtoll(value.c_str(), nullptr, 10);
}

std::string Connection::text(const std::string& sql) {
    sqlite3_stmt* raw = nullptr;
    int code = sqlite3_prepare_v2(db_, sql.c_str(), -1, &raw, nullptr);
    const StatementPtr statement(raw);
    if (code != SQLITE_OK) raiseLast(code, kSchema);
    code = sqlite3_step(raw);
    if (code == SQLITE_DONE) return {};
    if (code != SQLITE_ROW) raiseLast(code, sql.c_str());
    return textOf(db_, raw, 0);
}

void Connection::rollback() noexcept {
    // After some failures (disk full, I/O error) SQLite has rolled back already.
    if (sqlite3_get_autocommit(db_) != 0) return;
    sqlite3_step(rollback_.get());
    sqlite3_reset(rollback_.get());
}

std::int64_t Connection::changes() const noexcept { return sqlite3_changes64(db_); }

std::int64_t Connection::totalChanges() const noexcept { return sqlite3_total_changes64(db_); }

std::int64_t Connection::lastInsertId() const noexcept { return sqlite3_last_insert_rowid(db_); }

bool Connection::truncateWal(int waitMs) {
    sqlite3_busy_timeout(db_, waitMs);
    const int code = sqlite3_wal_checkpoint_v2(db_, "main", SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
    sqlite3_busy_timeout(db_, busyTimeoutMs_);
    if ((code & 0xff) == SQLITE_BUSY) return false;
    if (code != SQLITE_OK) raiseLast(code);
    return true;
}

void Connection::rewriteWal() {
    sqlite3_file* log = nullptr;
    sqlite3_file_control(db_, "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
    if (log == nullptr || log->pMethods == nullptr) return;
    sqlite3_int64 size = 0;
    int code = log->pMethods->xFileSize(log, &size);
    if (size == 0 && code == SQLITE_OK) return;
    std::vector<char> bytes(kRewriteBytes);
    for (sqlite3_int64 at = 0; at < size && code == SQLITE_OK; at += kRewriteBytes) {
        const int part = static_cast<int>(std::min<sqlite3_int64>(kRewriteBytes, size - at));
        code = log->pMethods->xRead(log, bytes.data(), part, at);
        if (code == SQLITE_OK) code = log->pMethods->xWrite(log, bytes.data(), part, at);
    }
    if (code == SQLITE_OK) code = log->pMethods->xSync(log, SQLITE_SYNC_FULL);
    if (code != SQLITE_OK)
        throw Failure(codeOf(code, filesAreFull(db_)),
                      "the log cannot be written again (SQLite code " + std::to_string(code) + ")", true);
}

sqlite3_stmt* Connection::prepared(const char* sql) {
    const auto found = statements_.find(sql);
    if (found != statements_.end()) return found->second.get();
    sqlite3_stmt* raw = nullptr;
    const int code = sqlite3_prepare_v3(db_, sql, -1, SQLITE_PREPARE_PERSISTENT, &raw, nullptr);
    StatementPtr statement(raw);
    if (code != SQLITE_OK) raiseLast(code, kSchema);
    statements_.emplace(sql, std::move(statement));
    return raw;
}

Query::Query(Connection& connection, const char* sql)
    : connection_(connection), statement_(connection.prepared(sql)) {}

Query::~Query() {
    // A statement left before its last row would keep its read open.
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
}

void Query::check(int code) const {
    if (code != SQLITE_OK) connection_.raiseLast(code);
}

void Query::bind(int position, const std::string& value) {
    // SQLite copies it (TRANSIENT): it may be a temporary of the caller.
    check(
        sqlite3_bind_text64(statement_, position, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
}

void Query::bind(int position, BlobView value) {
    // A null pointer would bind NULL instead of an empty blob.
    const void* data = value.data != nullptr ? value.data : "";
    check(sqlite3_bind_blob64(statement_, position, data, value.size, SQLITE_STATIC));
}

void Query::bind(int position, ZeroBlob value) {
    check(sqlite3_bind_zeroblob64(statement_, position, value.size));
}

void Query::bind(int position, double value) { check(sqlite3_bind_double(statement_, position, value)); }

void Query::bindInteger(int position, std::int64_t value) {
    check(sqlite3_bind_int64(statement_, position, value));
}

bool Query::step() {
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    connection_.raiseLast(code, sqlite3_sql(statement_));
}

void Query::run() {
    while (step()) {
    }
}

std::int64_t Query::integer(int column) const { return sqlite3_column_int64(statement_, column); }

double Query::real(int column) const { return sqlite3_column_double(statement_, column); }

bool Query::isNull(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

std::string Query::text(int column) const { return textOf(connection_.db_, statement_, column); }

BlobView Query::blob(int column) const {
    const void* data = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    if (data == nullptr && sqlite3_errcode(connection_.db_) == SQLITE_NOMEM) throw std::bad_alloc();
    return {data, data == nullptr ? 0 : static_cast<std::size_t>(size)};
}

Transaction::Transaction(Connection& connection, Kind kind) : connection_(connection) {
    connection.rollback();  // one that could not be ended, as a last resort
    Query(connection, kind == Kind::kWrite ? kBeginWrite : kBeginRead).run();
}

Transaction::~Transaction() {
    if (open_) connection_.rollback();
}

void Transaction::commit() {
    // When this throws, the transaction is still open and the destructor rolls it back.
    Query(connection_, kCommit).run();
    open_ = false;
}

BlobWriter::BlobWriter(Connection& connection, const char* table, const char* column, std::int64_t rowId)
    : connection_(connection) {
    constexpr int kForWriting = 1;
    const int code =
        sqlite3_blob_open(connection.handle(), "main", table, column, rowId, kForWriting, &blob_);
    if (code != SQLITE_OK) connection.raiseLast(code);
}

BlobWriter::~BlobWriter() { sqlite3_blob_close(blob_); }

void BlobWriter::append(const void* data, std::size_t size) {
    // SQLite holds no blob of 2^31 bytes and refuses to write past the end of one.
    if (size > static_cast<std::size_t>(std::numeric_limits<int>::max() - at_))
        raise(ErrorCode::kInternal, "a blob is written past its end");
    const int code = sqlite3_blob_write(blob_, data, static_cast<int>(size), at_);
    if (code != SQLITE_OK) connection_.raiseLast(code);
    at_ += static_cast<int>(size);
}

Interruptible::Interruptible(Connection& connection, const RunContext& context) : connection_(connection) {
    sqlite3_progress_handler(
        connection.handle(), kProgressSteps,
        [](void* raw) { return static_cast<const RunContext*>(raw)->checkpoint() ? 0 : 1; },
        const_cast<RunContext*>(&context));
}

Interruptible::~Interruptible() { sqlite3_progress_handler(connection_.handle(), 0, nullptr, nullptr); }

PageCopy::PageCopy(Connection& from, Connection& to)
    : to_(to), backup_(sqlite3_backup_init(to.handle(), "main", from.handle(), "main")) {
    if (backup_ == nullptr) to.raiseLast(sqlite3_extended_errcode(to.handle()));
}

PageCopy::~PageCopy() { sqlite3_backup_finish(static_cast<sqlite3_backup*>(backup_)); }

bool PageCopy::step(int pages) {
    const int code = sqlite3_backup_step(static_cast<sqlite3_backup*>(backup_), pages);
    if (code == SQLITE_DONE) return true;
    if (code == SQLITE_OK) return false;
    // The error is in the backup object; finishing it moves it to the connection.
    sqlite3_backup_finish(static_cast<sqlite3_backup*>(std::exchange(backup_, nullptr)));
    to_.raiseLast(code);
}

std::uint64_t PageCopy::donePages() const noexcept {
    return totalPages() -
           static_cast<std::uint64_t>(sqlite3_backup_remaining(static_cast<sqlite3_backup*>(backup_)));
}

std::uint64_t PageCopy::totalPages() const noexcept {
    return static_cast<std::uint64_t>(sqlite3_backup_pagecount(static_cast<sqlite3_backup*>(backup_)));
}

}  // namespace shapedb::store
