// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/connection.h"

#include <algorithm>
#include <cerrno>
#include <limits>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "server/store/sql/sql.h"

namespace shapedb::store {

namespace {

constexpr char kBeginRead[] = "BEGIN";
// Takes the write lock at once. A transaction that reads first may be refused it later.
constexpr char kBeginWrite[] = "BEGIN IMMEDIATE";
constexpr char kCommit[] = "COMMIT";
constexpr char kRollback[] = "ROLLBACK";
constexpr char kInsertPoints[] =
    "INSERT INTO shape_points (shape_id, point_bytes, stored_bytes, points) VALUES (?1, ?2, ?3, ?4)";
// Takes no memory for the blob.
constexpr char kInsertZeros[] =
    "INSERT INTO shape_points (shape_id, point_bytes, stored_bytes, points) VALUES (?1, ?2, ?3, "
    "zeroblob(?3))";

// Slow, and right while the tables can be read: what a damaged index holds is in its table, too.
constexpr char kShapeWithoutIndex[] = "SELECT " SHAPEDB_SHAPE_COLUMNS
                                      " FROM shape s NOT INDEXED LEFT JOIN shape_metadata m ON m.shape_id = "
                                      "s.id WHERE s.collection_id = ?1 AND s.key = ?2";
constexpr char kSignatureWithoutIndex[] =
    "SELECT s.key, s.state, s.failure_message, g.points_version, g.generation, g.digest, g.bytes, g.views "
    "FROM shape s NOT INDEXED JOIN collection c ON c.id = s.collection_id LEFT JOIN signature g NOT INDEXED "
    "ON "
    "g.shape_id = s.id AND g.generation = c.generation WHERE s.id = ?1";
// Searches tell how many shapes are pending: a damaged index must not stop them.
constexpr char kCountWithoutIndex[] = "SELECT count(*) FROM shape NOT INDEXED WHERE collection_id = ?1";
constexpr char kCountInStateWithoutIndex[] =
    "SELECT count(*) FROM shape NOT INDEXED WHERE collection_id = ?1 AND state = ?2";
constexpr char kCountWaitingOneByOne[] =
    "SELECT count(*) FROM shape s NOT INDEXED WHERE s.collection_id = ?1 AND s.state = 0 AND NOT EXISTS "
    "(SELECT 1 FROM signature g WHERE g.shape_id = s.id)";
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

void SqliteConnection::StatementCloser::operator()(sqlite3_stmt* statement) const noexcept {
    sqlite3_finalize(statement);
}

SqliteConnection::SqliteConnection(const std::string& path, OpenMode mode, int busyTimeoutMs)
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

SqliteConnection::~SqliteConnection() { closeAll(); }

void SqliteConnection::closeAll() noexcept {
    statements_.clear();
    rollback_.reset();
    sqlite3_close(db_);
}

void SqliteConnection::raiseLast(int code, const char* sql) const {
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

void SqliteConnection::execute(const std::string& sql) {
    const int code = sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr);
    if (code != SQLITE_OK) raiseLast(code, sql.rfind("PRAGMA", 0) == 0 ? kSchema : sql.c_str());
}

std::int64_t SqliteConnection::integer(const std::string& sql) {
    const std::string value = text(sql);
    return value.empty() ? 0 : std::strtoll(value.c_str(), nullptr, 10);
}

std::string SqliteConnection::text(const std::string& sql) {
    sqlite3_stmt* raw = nullptr;
    int code = sqlite3_prepare_v2(db_, sql.c_str(), -1, &raw, nullptr);
    const StatementPtr statement(raw);
    if (code != SQLITE_OK) raiseLast(code, kSchema);
    code = sqlite3_step(raw);
    if (code == SQLITE_DONE) return {};
    if (code != SQLITE_ROW) raiseLast(code, sql.c_str());
    return textOf(db_, raw, 0);
}

void SqliteConnection::rollback() noexcept {
    // After some failures (disk full, I/O error) SQLite has rolled back already.
    if (sqlite3_get_autocommit(db_) != 0) return;
    sqlite3_step(rollback_.get());
    sqlite3_reset(rollback_.get());
}

std::int64_t SqliteConnection::changes() const noexcept { return sqlite3_changes64(db_); }

std::int64_t SqliteConnection::totalChanges() const noexcept { return sqlite3_total_changes64(db_); }

std::int64_t SqliteConnection::lastInsertId() const noexcept { return sqlite3_last_insert_rowid(db_); }

bool SqliteConnection::truncateWal(int waitMs) {
    sqlite3_busy_timeout(db_, waitMs);
    const int code = sqlite3_wal_checkpoint_v2(db_, "main", SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
    sqlite3_busy_timeout(db_, busyTimeoutMs_);
    if ((code & 0xff) == SQLITE_BUSY) return false;
    if (code != SQLITE_OK) raiseLast(code);
    return true;
}

void SqliteConnection::rewriteWal() {
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

class SqliteConnection::CachedStatement final : public PreparedStatement {
  public:
    CachedStatement(const SqliteConnection& connection, StatementPtr statement)
        : connection_(connection), statement_(std::move(statement)) {}

    void bindInteger(int position, std::int64_t value) override {
        check(sqlite3_bind_int64(statement_.get(), position, value));
    }
    void bindReal(int position, double value) override {
        check(sqlite3_bind_double(statement_.get(), position, value));
    }
    void bindText(int position, const std::string& value) override {
        // SQLite copies it (TRANSIENT): it may be a temporary of the caller.
        check(sqlite3_bind_text64(statement_.get(), position, value.data(), value.size(), SQLITE_TRANSIENT,
                                  SQLITE_UTF8));
    }
    void bindBlob(int position, BlobView value) override {
        // A null pointer would bind NULL instead of an empty blob.
        const void* data = value.data != nullptr ? value.data : "";
        check(sqlite3_bind_blob64(statement_.get(), position, data, value.size, SQLITE_STATIC));
    }
    void bindNull(int position) override { check(sqlite3_bind_null(statement_.get(), position)); }

    bool step() override {
        const int code = sqlite3_step(statement_.get());
        if (code == SQLITE_ROW) return true;
        if (code == SQLITE_DONE) return false;
        connection_.raiseLast(code, sqlite3_sql(statement_.get()));
    }

    std::int64_t integer(int column) const override { return sqlite3_column_int64(statement_.get(), column); }
    double real(int column) const override { return sqlite3_column_double(statement_.get(), column); }
    bool isNull(int column) const override {
        return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
    }
    std::string text(int column) const override { return textOf(connection_.db_, statement_.get(), column); }
    BlobView blob(int column) const override {
        const void* data = sqlite3_column_blob(statement_.get(), column);
        const int size = sqlite3_column_bytes(statement_.get(), column);
        if (data == nullptr && sqlite3_errcode(connection_.db_) == SQLITE_NOMEM) throw std::bad_alloc();
        return {data, data == nullptr ? 0 : static_cast<std::size_t>(size)};
    }

    void reset() noexcept override {
        // A statement left before its last row would keep its read open.
        sqlite3_reset(statement_.get());
        sqlite3_clear_bindings(statement_.get());
    }

  private:
    void check(int code) const {
        if (code != SQLITE_OK) connection_.raiseLast(code);
    }

    const SqliteConnection& connection_;
    StatementPtr statement_;
};

PreparedStatement& SqliteConnection::prepared(const char* sql) {
    const auto found = statements_.find(sql);
    if (found != statements_.end()) return *found->second;
    sqlite3_stmt* raw = nullptr;
    const int code = sqlite3_prepare_v3(db_, sql, -1, SQLITE_PREPARE_PERSISTENT, &raw, nullptr);
    StatementPtr statement(raw);
    if (code != SQLITE_OK) raiseLast(code, kSchema);
    auto cached = std::make_unique<CachedStatement>(*this, std::move(statement));
    return *statements_.emplace(sql, std::move(cached)).first->second;
}

void SqliteConnection::beginRead() { Query(*this, kBeginRead).run(); }

void SqliteConnection::beginWrite() { Query(*this, kBeginWrite).run(); }

void SqliteConnection::commit() { Query(*this, kCommit).run(); }

namespace {

/// Fills a blob of zeros from start to end, so that SQLite never holds it whole. Use it inside the
/// transaction that inserted the blob.
class BlobWriter {
  public:
    /// The names must outlive this.
    BlobWriter(const SqliteConnection& connection, const char* table, const char* column, std::int64_t rowId)
        : connection_(connection) {
        constexpr int kForWriting = 1;
        const int code =
            sqlite3_blob_open(connection.handle(), "main", table, column, rowId, kForWriting, &blob_);
        if (code != SQLITE_OK) connection.raiseLast(code);
    }
    ~BlobWriter() { sqlite3_blob_close(blob_); }
    BlobWriter(const BlobWriter&) = delete;
    BlobWriter& operator=(const BlobWriter&) = delete;

    /// Throws Failure also when the blob is full.
    void append(const void* data, std::size_t size) {
        // SQLite holds no blob of 2^31 bytes and refuses to write past the end of one.
        if (size > static_cast<std::size_t>(std::numeric_limits<int>::max() - at_))
            raise(ErrorCode::kInternal, "a blob is written past its end");
        const int code = sqlite3_blob_write(blob_, data, static_cast<int>(size), at_);
        if (code != SQLITE_OK) connection_.raiseLast(code);
        at_ += static_cast<int>(size);
    }

  private:
    const SqliteConnection& connection_;
    sqlite3_blob* blob_ = nullptr;
    int at_ = 0;
};

}  // namespace

void SqliteConnection::insertPoints(std::int64_t shapeId, std::uint64_t pointBytes, const BlobSource& blob) {
    if (blob.whole != nullptr) {
        Query(*this, kInsertPoints, shapeId, pointBytes, blob.size, viewOf(*blob.whole)).run();
        return;
    }
    Query(*this, kInsertZeros, shapeId, pointBytes, blob.size).run();
    BlobWriter writer(*this, "shape_points", "points", shapeId);
    blob.write([&](const void* data, std::size_t size) { writer.append(data, size); });
}

const char* SqliteConnection::withoutIndices(const char* sql) const noexcept {
    if (sql == sql::kShapeByKey) return kShapeWithoutIndex;
    if (sql == sql::kServingSignature) return kSignatureWithoutIndex;
    if (sql == sql::kCountShapes) return kCountWithoutIndex;
    if (sql == sql::kCountShapesInState) return kCountInStateWithoutIndex;
    if (sql == sql::kCountWaiting) return kCountWaitingOneByOne;
    return nullptr;
}

Interruptible::Interruptible(SqliteConnection& connection, const RunContext& context)
    : connection_(connection) {
    sqlite3_progress_handler(
        connection.handle(), kProgressSteps,
        [](void* raw) { return static_cast<const RunContext*>(raw)->checkpoint() ? 0 : 1; },
        const_cast<RunContext*>(&context));
}

Interruptible::~Interruptible() { sqlite3_progress_handler(connection_.handle(), 0, nullptr, nullptr); }

PageCopy::PageCopy(SqliteConnection& from, SqliteConnection& to)
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
