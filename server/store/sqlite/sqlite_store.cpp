// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/sqlite_store.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/store/failpoints.h"
#include "server/store/sql/rows.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/database_file.h"
#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/sequences.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

/// Programs with an earlier schema left the file open always.
constexpr int kFirstClosed = 7;

constexpr int kWalAutoCheckpointPages = 1000;
/// Beyond this size a commit waits for readers, so that the log can start from the beginning.
constexpr std::uint64_t kWalBoundBytes = 64u << 20;
/// Growth between two such attempts, and the longest wait of each.
constexpr std::uint64_t kWalRetryBytes = 16u << 20;
constexpr int kWalWaitMs = 500;
/// The log file is cut to this size after each write-back: bursts do not keep disk space.
constexpr std::uint64_t kWalKeepBytes = 16u << 20;

std::uint64_t fileSize(const std::string& path) noexcept {
    struct stat status {};
    return ::stat(path.c_str(), &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

SqliteOptions completed(SqliteOptions options) {
    if (options.path.empty()) raise(ErrorCode::kInvalidArgument, "the database path is empty");
    if (options.readers < 1 || options.readers > 64) {
        raise(ErrorCode::kInvalidArgument, "readers must be 1 to 64, not " + std::to_string(options.readers));
    }
    if (options.busyTimeoutMs < 0) {
        raise(ErrorCode::kInvalidArgument, "the busy timeout must not be negative");
    }
    requireCompressionLevel(options.pointCompressionLevel);
    if (!options.now) options.now = systemNow;
    options.path = std::filesystem::absolute(options.path).lexically_normal().string();
    return options;
}

[[noreturn]] void raiseSystem(const std::string& what, int why) {
    const bool full = why == ENOSPC || why == EFBIG || why == EDQUOT;
    raise(full ? ErrorCode::kStorageFull : ErrorCode::kStorage, what + ": " + std::strerror(why));
}

void syncPath(const std::string& path, int flags) {
    const int descriptor = open(path.c_str(), flags | O_CLOEXEC);
    const bool ok = descriptor >= 0 && fsync(descriptor) == 0;
    const int why = errno;
    if (descriptor >= 0) close(descriptor);
    if (!ok) raiseSystem("cannot make '" + path + "' durable", why);
}

/// A new database gets its name when it is complete: an empty file is always damage, never a fresh
/// start.
void createDatabase(const SqliteOptions& options) {
    const std::string fresh = options.path + ".new";
    std::filesystem::remove(fresh);
    const int descriptor = open(fresh.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (descriptor < 0) raiseSystem("cannot create database '" + options.path + "'", errno);
    close(descriptor);
    SHAPEDB_FAILPOINT("create.file");
    {
        SqliteConnection connection(fresh, OpenMode::kReadWrite, options.busyTimeoutMs);
        makeEmptyDatabase(connection, options.now());
    }
    SHAPEDB_FAILPOINT("create.filled");
    syncPath(fresh, O_RDONLY);
    SHAPEDB_FAILPOINT("create.synced");
    if (::rename(fresh.c_str(), options.path.c_str()) != 0)
        raiseSystem("cannot create database '" + options.path + "'", errno);
    SHAPEDB_FAILPOINT("create.named");
    syncPath(std::filesystem::path(options.path).parent_path().string(), O_RDONLY | O_DIRECTORY);
}

void requireUsableFile(const SqliteOptions& options) {
    // The log and the lock are beside the link: through two of them two servers would have one database open.
    if (std::filesystem::is_symlink(options.path)) {
        raise(ErrorCode::kStorage,
              "the database '" + options.path +
                  "' is a symbolic link, which is not followed: put the file itself there");
    }
    if (std::filesystem::is_directory(options.path)) {
        raise(ErrorCode::kStorage, "the database path '" + options.path + "' is a folder");
    }
    const std::string wal = options.path + "-wal";
    if (!std::filesystem::exists(options.path)) {
        if (fileSize(wal) > 0) {
            raise(ErrorCode::kDataLoss, "'" + wal + "' exists but its database '" + options.path +
                                            "' is not; put the database back or move the log away");
        }
        createDatabase(options);
    } else if (fileSize(options.path) == 0) {
        raise(ErrorCode::kDataLoss,
              "the database '" + options.path +
                  "' is empty; replace it by a backup, or remove it to start with an empty database");
    }
}

/// What another process left in the log may be in the system's memory only: after a sync that failed, Linux
/// takes the pages for written. They would be missing after a loss of power, and with them all that follows
/// in the log.
void rewriteOldWal(SqliteConnection& writer) {
    try {
        writer.rewriteWal();
    } catch (const Failure& failure) {
        // What is stored can be read all the same.
        if (failure.error.code != ErrorCode::kStorageFull) throw;
    }
}

/// While a server has it open, the file itself says so: it has a write-ahead log. One that was closed cleanly
/// is complete without any file beside it, like a backup.
bool isOpenInFile(SqliteConnection& connection) { return connection.text("PRAGMA journal_mode") == "wal"; }

/// Opens the database, checks that it is ours before writing a byte, and migrates it. `wasOpen`: its last
/// server did not close it, and counted its commits.
std::unique_ptr<SqliteConnection> openWriter(const SqliteOptions& options, const CommitMark& mark,
                                             const ProcessLock& lock, bool* wasOpen) {
    requireUsableFile(options);
    auto writer =
        std::make_unique<SqliteConnection>(options.path, OpenMode::kReadWrite, options.busyTimeoutMs);
    if (identify(*writer) != FileKind::kOurs) {
        raise(ErrorCode::kDataLoss, "'" + options.path + "' is not a ShapeDB database");
    }
    if (schemaVersion(*writer) > static_cast<int>(embeddedMigrations().size())) {
        migrate(*writer, embeddedMigrations(), options.now());  // refuses, with the reason
    }
    *wasOpen = isOpenInFile(*writer) && schemaVersion(*writer) >= kFirstClosed;
    // Before the file says that it is open: from then on a mark that is missing was lost.
    if (!*wasOpen && !lock.wasComplete() && !mark.read()) {
        mark.write(0);
        static_cast<void>(mark.sync());
    }
    SHAPEDB_FAILPOINT("open.mark");
    const std::string mode = writer->text("PRAGMA journal_mode=WAL");
    if (mode != "wal") {
        raise(ErrorCode::kStorage, "'" + options.path + "' cannot use a write-ahead log (journal mode " +
                                       mode + "): it needs a local file system");
    }
    writer->execute("PRAGMA wal_autocheckpoint=" + std::to_string(kWalAutoCheckpointPages) +
                    "; PRAGMA journal_size_limit=" + std::to_string(kWalKeepBytes) +
                    "; PRAGMA secure_delete=FAST");
    SHAPEDB_FAILPOINT("open.log");
    rewriteOldWal(*writer);
    SHAPEDB_FAILPOINT("open.log_rewritten");
    migrate(*writer, embeddedMigrations(), options.now());
    SHAPEDB_FAILPOINT("open.migrated");
    return writer;
}

}  // namespace

// In this order: nothing touches the file before it is locked, and readers, which are read-only, need a file
// that has its log and its tables.
SqliteStore::SqliteStore(const SqliteOptions& options)
    : options_(completed(options)),
      walPath_(options_.path + "-wal"),
      lock_(options_.path),
      reserve_(options_.path + ".reserve"),
      mark_(options_.path + ".commits"),
      writer_(openWriter(options_, mark_, lock_, &wasOpen_)),
      readers_(std::make_unique<ReaderPool>(options_.path, options_.readers, options_.busyTimeoutMs)),
      walAttemptAt_(kWalBoundBytes) {
    // Without it deletions may be refused on a full disk; uploads ask again.
    static_cast<void>(reserve_.hold());
    findings_ = damagedTables(*writer_, queueDamage_);
    damaged_ = !findings_.empty();
    unlessDamaged([&] {
        for (std::string& mended : mendSequences(*writer_)) findings_.push_back(std::move(mended));
    });
    unlessDamaged([&] { checkSmallValues(); });
    unlessDamaged([&] { compareCommits(); });
    // What a dead process had in hand: its copies of files, which may be as large as the database,
    for (const char* copy : {".restore", ".import"})
        static_cast<void>(TemporaryDatabase(options_.path + copy));
    // and shapes, which are left where they are if the disk fails: no client sees them.
    static_cast<void>(dropImport());
    static_cast<void>(dropDeleted());
}

SqliteStore::~SqliteStore() {
    readers_.reset();
    // Without a log beside it the file is whole. Otherwise the next start finds it open, and what belongs to
    // it there.
    static_cast<void>(guarded("close the database", [&] {
        const std::string mode = writer_->text("PRAGMA journal_mode=DELETE");
        if (mode != "delete") raise(ErrorCode::kStorage, "somebody else reads the database");
    }));
}

void SqliteStore::writeOnce(const Work& work) {
    const std::lock_guard<std::mutex> lock(writerMutex_);
    Transaction transaction(*writer_, Transaction::Kind::kWrite);
    const std::int64_t before = writer_->totalChanges();
    work(*writer_);
    commit(transaction, before);
}

// On a full disk a second time: what frees space, and what fits into free pages of the database. The log gets
// the space of the reserve, and gives it back when it has been written back: what is written must not let the
// database grow.
void SqliteStore::inWriteTransaction(Space space, const Work& work) {
    std::optional<Failure> full;
    try {
        return writeOnce(work);
    } catch (const Failure& failure) {
        if (failure.error.code != ErrorCode::kStorageFull || space == Space::kTakesOnce) throw;
        full = failure;
    }
    if (space == Space::kTakes && !hasFreePages()) throw *full;
    const SpaceReserve::Loan loan(reserve_);
    try {
        writeOnce(work);
    } catch (...) {
        emptyLog();
        throw;
    }
    emptyLog();
}

void SqliteStore::inReadTransaction(const Work& work) {
    const ReaderPool::Lease lease = readers_->acquire();
    const Transaction snapshot(*lease, Transaction::Kind::kRead);
    work(*lease);
}

std::vector<Collection> SqliteStore::salvageCollections(Connection& connection, const Failure& damage) {
    if (damage.error.code != ErrorCode::kDataLoss) throw damage;
    return store::salvageCollections(ours(connection), damage.error);
}

std::vector<Alias> SqliteStore::salvageAliases(Connection& connection, const Failure& damage) {
    if (damage.error.code != ErrorCode::kDataLoss) throw damage;
    return store::salvageAliases(ours(connection));
}

Result<std::vector<Shape>> SqliteStore::recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) {
    {
        // It may go unnoticed until the first job is queued.
        const std::lock_guard<std::mutex> lock(findingsMutex_);
        if (queueDamage_) return fail(ErrorCode::kDataLoss, *queueDamage_);
    }
    return SqlStore::recoverJobs(maxAttempts, crashes);
}

void SqliteStore::commit(Transaction& transaction, std::int64_t changesBefore) {
    if (writer_->totalChanges() == changesBefore) {
        transaction.commit();
        return;
    }
    SHAPEDB_FAILPOINT("commit.changed");
    const std::int64_t commits = addCommit(*writer_);
    SHAPEDB_FAILPOINT("commit.counted");
    transaction.commit();
    SHAPEDB_FAILPOINT("commit.committed");
    mark_.write(commits);
    SHAPEDB_FAILPOINT("commit.marked");
    boundWal();
}

// SQLite writes the log back every thousand pages, but cannot start it from the beginning while reads overlap
// without a gap. Past a bound this waits for a gap: not long, and not again before the log has grown further.
void SqliteStore::boundWal() noexcept {
    const std::uint64_t size = fileSize(walPath_);
    if (size < walAttemptAt_) {
        if (size < kWalBoundBytes) walAttemptAt_ = kWalBoundBytes;
        return;
    }
    walAttemptAt_ = size + kWalRetryBytes;
    // The commit is done; a failed write-back does not undo it and is tried again.
    static_cast<void>(guarded("write back the log", [&] {
        if (writer_->truncateWal(longReads_ > 0 ? 0 : kWalWaitMs)) walAttemptAt_ = kWalBoundBytes;
    }));
}

// Statistics -----------------------------------------------------------------------------

Result<StoreStats> SqliteStore::stats() {
    return read("read the statistics", [&](Connection& connection) {
        StoreStats stats = readStats(connection);
        stats.databaseBytes = fileSize(options_.path);
        stats.walBytes = fileSize(walPath_);
        stats.schemaVersion = schemaVersion(ours(connection));
        const std::lock_guard<std::mutex> lock(findingsMutex_);
        stats.missingCommits = static_cast<std::uint64_t>(missingCommits_);
        stats.notices = notices_.size();
        return stats;
    });
}

Result<std::uint64_t> SqliteStore::backupBytes() { return fileSize(options_.path); }

Result<void> SqliteStore::checkpoint() {
    return guarded("write back the log", [&] {
        const std::lock_guard<std::mutex> lock(writerMutex_);
        if (!writer_->truncateWal(options_.busyTimeoutMs)) {
            raise(ErrorCode::kStorage, "cannot write back the log: a read is still running; try again later");
        }
        SHAPEDB_FAILPOINT("checkpoint.written_back");
        walAttemptAt_ = kWalBoundBytes;
    });
}

bool stopCountingSqliteMemory() noexcept { return sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0) == SQLITE_OK; }

Result<std::unique_ptr<Store>> openSqliteStore(const SqliteOptions& options) {
    return guarded("open the database", [&]() -> std::unique_ptr<Store> {
        // Without a server there is nobody to check or to restore.
        return withRemedy("move '" + options.path +
                              "' and what is beside it under that name away, start again, and restore a "
                              "backup with 'shapedb admin restore'",
                          [&] { return std::make_unique<SqliteStore>(options); });
    });
}

}  // namespace shapedb::store
