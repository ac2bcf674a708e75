// Backup, restore and check.
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/store/failpoints.h"
#include "server/store/sqlite/check.h"
#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/rows.h"
#include "server/store/sqlite/sequences.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

namespace fs = std::filesystem;

/// 1 MiB between two checks for cancellation.
constexpr int kStepPages = 256;
constexpr std::size_t kCopyBytes = 1u << 20;

/// Removes a temporary database and the files SQLite may put beside it.
class TemporaryFile {
  public:
    explicit TemporaryFile(const std::string& path)
        : paths_{path, path + "-journal", path + "-wal", path + "-shm"} {
        remove();
    }
    ~TemporaryFile() { remove(); }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    const std::string& path() const { return paths_.front(); }

  private:
    void remove() const noexcept {
        for (const std::string& path : paths_) ::unlink(path.c_str());
    }

    std::array<std::string, 4> paths_;  ///< made at once: removing must not need memory
};

class File {
  public:
    File(const std::string& path, int flags) : descriptor_(::open(path.c_str(), flags | O_CLOEXEC, 0600)) {}
    ~File() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    int get() const { return descriptor_; }

  private:
    int descriptor_;
};

class Counted {
  public:
    explicit Counted(std::atomic<int>& counter) : counter_(counter) { ++counter_; }
    ~Counted() { --counter_; }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;

  private:
    std::atomic<int>& counter_;
};

[[noreturn]] void raiseUnwritable(const std::string& path, int why) {
    const ErrorCode code = why == ENOSPC || why == EFBIG || why == EDQUOT ? ErrorCode::kStorageFull
                                                                          : ErrorCode::kFileNotWritable;
    raise(code, "cannot write '" + path + "': " + std::strerror(why));
}

void createPrivate(const std::string& path) {
    const File file(path, O_RDWR | O_CREAT | O_EXCL);
    if (file.get() < 0) raiseUnwritable(path, errno);
}

/// Gives the finished file its name; never replaces another file. First the content is made durable, then the
/// name: after a crash there is a whole file or none.
void publish(const std::string& temporary, const std::string& path) {
    {
        const File file(temporary, O_RDONLY);
        if (file.get() < 0 || ::fsync(file.get()) != 0) raiseUnwritable(path, errno);
    }
    SHAPEDB_FAILPOINT("backup.synced");
    fs::path folder = fs::path(path).parent_path();
    if (folder.empty()) folder = ".";
    const File directory(folder.string(), O_RDONLY | O_DIRECTORY);
    if (directory.get() < 0) raiseUnwritable(path, errno);
    if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) != 0) {
        if (errno == EEXIST)
            raise(ErrorCode::kAlreadyExists, "'" + path + "' already exists; choose a new name");
        // EINVAL: the file system does not know the flag.
        if (errno != EINVAL) raiseUnwritable(path, errno);
        if (fs::exists(path))
            raise(ErrorCode::kAlreadyExists, "'" + path + "' already exists; choose a new name");
        if (::rename(temporary.c_str(), path.c_str()) != 0) raiseUnwritable(path, errno);
    }
    SHAPEDB_FAILPOINT("backup.named");
    if (::fsync(directory.get()) != 0) {
        const int why = errno;
        ::unlink(path.c_str());  // nothing is left of a backup that failed
        raiseUnwritable(path, why);
    }
}

void copyBytes(const std::string& from, const std::string& to, const RunContext& context) {
    const File source(from, O_RDONLY);
    struct stat status {};
    if (source.get() < 0 || ::fstat(source.get(), &status) != 0) {
        raise(ErrorCode::kFileNotReadable, "cannot read '" + from + "': " + std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) raise(ErrorCode::kFileNotReadable, "'" + from + "' is not a file");
    const File target(to, O_WRONLY | O_CREAT | O_EXCL);
    if (target.get() < 0) raiseUnwritable(to, errno);
    std::vector<char> buffer(kCopyBytes);
    std::uint64_t done = 0;
    while (true) {
        orRaise(context.checkpoint());
        context.report("copy", done, static_cast<std::uint64_t>(status.st_size));
        const ssize_t got = ::read(source.get(), buffer.data(), buffer.size());
        if (got < 0)
            raise(ErrorCode::kFileNotReadable, "cannot read '" + from + "': " + std::strerror(errno));
        if (got == 0) return;
        for (ssize_t written = 0; written < got;) {
            const ssize_t n =
                ::write(target.get(), buffer.data() + written, static_cast<std::size_t>(got - written));
            if (n < 0) raiseUnwritable(to, errno);
            written += n;
        }
        done += static_cast<std::uint64_t>(got);
    }
}

/// A file of a running database is not a backup.
void requireBackupFile(const std::string& path, const std::string& livePath) {
    std::error_code error;
    if (!fs::exists(path, error)) {
        raise(ErrorCode::kFileNotReadable, "there is no file '" + path + "'");
    }
    if (fs::equivalent(path, livePath, error)) {
        raise(ErrorCode::kMalformedFile, "'" + path + "' is the database in use, not a backup of it");
    }
    const std::uintmax_t wal = fs::file_size(path + "-wal", error);
    if (!error && wal > 0) {
        raise(ErrorCode::kMalformedFile, "'" + path +
                                             "' is a database in use (its log is beside it), not a "
                                             "backup; make one with the backup command");
    }
}

/// Reports a problem of the private copy as one of the file the user named.
template <typename Body>
void blaming(const std::string& path, Body body) {
    try {
        body();
    } catch (const Failure& failure) {
        switch (failure.error.code) {
            case ErrorCode::kDataLoss:
            case ErrorCode::kInternal:  // a constraint broken by the file's content
                raise(ErrorCode::kMalformedFile,
                      "'" + path + "' cannot be restored: " + failure.error.message);
            case ErrorCode::kSchemaTooNew:
                raise(ErrorCode::kSchemaTooNew,
                      "'" + path + "' cannot be restored: " + failure.error.message);
            default: throw;
        }
    }
}

/// Migrates the private copy of a backup and checks it.
void prepareCopy(Connection& copy, const RunContext& context, std::int64_t nowMs) {
    if (identify(copy) != FileKind::kOurs) raise(ErrorCode::kDataLoss, "it is not a ShapeDB database");
    if (copy.integer("PRAGMA page_size") != kPageSize) {
        raise(ErrorCode::kDataLoss, "its page size is not " + std::to_string(kPageSize));
    }
    copy.execute("PRAGMA synchronous=OFF");  // a crash loses only the copy
    const std::string mode = copy.text("PRAGMA journal_mode=DELETE");
    if (mode != "delete") raise(ErrorCode::kStorage, "cannot change the journal mode of the copy");
    migrate(copy, embeddedMigrations(), nowMs);
    const std::vector<std::string> problems = checkDatabase(copy, context);
    if (!problems.empty()) {
        raise(ErrorCode::kDataLoss,
              problems.front() +
                  (problems.size() > 1 ? " (and " + std::to_string(problems.size() - 1) + " more)" : ""));
    }
}

/// Ids are never reused, not even across a restore: new rows continue after both histories, and jobs
/// and rebuilds of the file get ids that the running server has never given out, so that a result in
/// flight cannot meet the wrong row.
/// Returns how many commits the copy counts then.
std::int64_t separateIds(Connection& copy, Connection& live) {
    const std::int64_t commits = std::max(countCommits(copy), countCommits(live)) + 1;
    Transaction transaction(copy, Transaction::Kind::kWrite);
    for (const char* table : {"collection", "shape"}) {
        setLastId(copy, table, std::max(lastId(copy, table), lastId(live, table)));
    }
    for (const std::string table : {"job", "rebuild"}) {
        const std::int64_t offset = std::max(lastId(copy, table), lastId(live, table));
        // The offset is no less than any id, so that no row moves to an id that another still has.
        copy.execute("UPDATE " + table + " SET id = id + " + std::to_string(offset));
        setLastId(copy, table, offset + lastId(copy, table));
    }
    // No mark of an acknowledged change is ahead of the database that replaces this one.
    copy.execute("UPDATE tally SET commits = " + std::to_string(commits));
    // The server that made the backup did not die of the jobs it was running.
    copy.execute("UPDATE job SET state = 0, attempts = attempts - 1 WHERE state = 1");
    transaction.commit();
    return commits;
}

}  // namespace

Result<void> SqliteStore::backup(const std::string& path, const RunContext& context) {
    return guarded("write the backup", [&] {
        if (fs::exists(path))
            raise(ErrorCode::kAlreadyExists, "'" + path + "' already exists; choose a new name");
        const TemporaryFile temporary(path + ".partial-" + std::to_string(::getpid()));
        createPrivate(temporary.path());
        SHAPEDB_FAILPOINT("backup.file");
        const Counted longRead(longReads_);
        {
            Connection source(options_.path, OpenMode::kReadOnly, options_.busyTimeoutMs);
            // Without an open snapshot every write would make SQLite restart the copy.
            const Transaction snapshot(source, Transaction::Kind::kRead);
            static_cast<void>(source.integer("SELECT count(*) FROM sqlite_schema"));
            Connection target(temporary.path(), OpenMode::kReadWrite, options_.busyTimeoutMs);
            target.execute("PRAGMA synchronous=OFF");  // `publish` makes the file durable
            copyDatabase(source, target, kStepPages, [&](std::uint64_t done, std::uint64_t total) {
                context.report("backup", done, total);
                orRaise(context.checkpoint());
            });
            SHAPEDB_FAILPOINT("backup.copied");
            // Without a log beside it, the file can be read from a folder that is not writable.
            if (target.text("PRAGMA journal_mode=DELETE") != "delete") {
                raise(ErrorCode::kStorage, "cannot turn the backup into a single file");
            }
        }
        SHAPEDB_FAILPOINT("backup.closed");
        publish(temporary.path(), path);
        SHAPEDB_FAILPOINT("backup.durable");
    });
}

Result<void> SqliteStore::restore(const std::string& path, const RunContext& context,
                                  const std::function<void()>& replacing) {
    return guarded("restore the backup", [&] {
        requireBackupFile(path, options_.path);
        const TemporaryFile temporary(options_.path + ".restore");
        // The file that the user named stays as it is; migrations change the copy.
        copyBytes(path, temporary.path(), context);
        SHAPEDB_FAILPOINT("restore.copied");
        std::unique_ptr<Connection> copy;
        blaming(path, [&] {
            copy =
                std::make_unique<Connection>(temporary.path(), OpenMode::kReadWrite, options_.busyTimeoutMs);
            prepareCopy(*copy, context, now());
        });
        // Until the end: no id may be given out between reading the last ones and replacing the tables.
        const std::lock_guard<std::mutex> lock(writerMutex_);
        SHAPEDB_FAILPOINT("restore.checked");
        const std::int64_t commits = separateIds(*copy, *writer_);
        SHAPEDB_FAILPOINT("restore.separated");
        if (replacing) replacing();
        copyDatabase(*copy, *writer_, kStepPages, [&](std::uint64_t done, std::uint64_t total) {
            context.report("restore", done, total);
            orRaise(context.checkpoint());
        });
        // The content is replaced: nothing may fail from here on.
        SHAPEDB_FAILPOINT("restore.replaced");
        mark_.write(commits);
        SHAPEDB_FAILPOINT("restore.marked");
        {
            const std::lock_guard<std::mutex> known(findingsMutex_);
            missingCommits_ = 0;
            findings_.clear();
        }
        boundWal();
    });
}

Result<std::vector<std::string>> SqliteStore::check(const RunContext& context) {
    return guarded("check the database", [&] {
        const Counted longRead(longReads_);
        Connection connection(options_.path, OpenMode::kReadOnly, options_.busyTimeoutMs);
        std::vector<std::string> problems = findings();
        for (std::string& problem : checkDatabase(connection, context))
            problems.push_back(std::move(problem));
        return problems;
    });
}

}  // namespace shapedb::store
