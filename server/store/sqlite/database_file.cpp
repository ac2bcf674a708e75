// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/database_file.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/store/failpoints.h"
#include "server/store/sql/collection_copy.h"
#include "server/store/sql/sql.h"
#include "server/store/sqlite/check.h"
#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/sequences.h"

namespace shapedb::store {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kCopyBytes = 1u << 20;

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

[[noreturn]] void raiseUnwritable(const std::string& path, int why) {
    const ErrorCode code = why == ENOSPC || why == EFBIG || why == EDQUOT ? ErrorCode::kStorageFull
                                                                          : ErrorCode::kFileNotWritable;
    raise(code, "cannot write '" + path + "': " + std::strerror(why));
}

[[noreturn]] void raiseExists(const std::string& path) {
    raise(ErrorCode::kAlreadyExists, "'" + path + "' already exists; choose a new name");
}

/// The path, if no file has it.
const std::string& requireNew(const std::string& path) {
    if (fs::exists(path)) raiseExists(path);
    return path;
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

[[noreturn]] void raiseForeign(const std::string& path, const FileUse& use) {
    raise(ErrorCode::kMalformedFile, quoted(path) + " " + use.foreign);
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

/// SQLite opens any file, and speaks of damage then. And it takes a file whose header names an encoding that
/// there is not for one in UTF-8, but not on the connections that are open when the file is restored.
void requireDatabase(const std::string& copyPath, const std::string& path, const FileUse& use) {
    constexpr std::string_view kStart("SQLite format 3\0", 16);
    constexpr std::size_t kEncodingAt = 56;
    constexpr std::string_view kUtf8("\0\0\0\1", 4);
    std::array<char, kEncodingAt + kUtf8.size()> header{};
    const File copy(copyPath, O_RDONLY);
    const ssize_t got = copy.get() < 0 ? 0 : ::read(copy.get(), header.data(), header.size());
    const std::string_view text(header.data(), header.size());
    if (got != static_cast<ssize_t>(header.size()) || text.substr(0, kStart.size()) != kStart) {
        raiseForeign(path, use);
    }
    if (text.substr(kEncodingAt) != kUtf8) {
        raise(ErrorCode::kMalformedFile, quoted(path) + " cannot be " + use.done +
                                             ": its header names another encoding of texts than UTF-8");
    }
}

/// Migrates the private copy of a backup and checks it.
void prepareCopy(SqliteConnection& copy, const SqliteOptions& options, const RunContext& context) {
    if (copy.integer("PRAGMA page_size") != kPageSize) {
        raise(ErrorCode::kDataLoss, "its page size is not " + std::to_string(kPageSize));
    }
    copy.execute("PRAGMA synchronous=OFF");  // a crash loses only the copy
    const std::string mode = copy.text("PRAGMA journal_mode=DELETE");
    if (mode != "delete") raise(ErrorCode::kStorage, "cannot change the journal mode of the copy");
    {
        // A file can be made so that its triggers keep a migration busy for ever.
        const Interruptible interruptible(copy, context);
        migrate(copy, embeddedMigrations(), options.now());
        // What was being imported or deleted when the backup was made would never be completed.
        copy.execute("DELETE FROM collection WHERE " SHAPEDB_HIDDEN("name"));
    }
    requireSound(copy, options, context);
}

/// What is wrong with the copy of `path`, as an error of the file that was named.
Failure blamed(const Failure& failure, const std::string& path, const FileUse& use) {
    std::string message = quoted(path) + " cannot be " + use.done + ": " + failure.error.message;
    // The database that runs is not damaged.
    const std::size_t remedy = message.find(std::string("; ") + kDamageRemedy);
    if (remedy != std::string::npos) message.resize(remedy);
    switch (failure.error.code) {
        case ErrorCode::kDataLoss:
        case ErrorCode::kInternal:  // a constraint broken by the file's content
            return {ErrorCode::kMalformedFile, message};
        case ErrorCode::kSchemaTooNew: return {ErrorCode::kSchemaTooNew, message};
        default: return failure;
    }
}

}  // namespace

void TemporaryDatabase::remove() const noexcept {
    for (const std::string& path : paths_) ::unlink(path.c_str());
}

NewFile::NewFile(const std::string& path)
    : path_(requireNew(path)), temporary_(path + ".partial-" + std::to_string(::getpid())) {
    const File file(temporary_.path(), O_RDWR | O_CREAT | O_EXCL);
    if (file.get() < 0) raiseUnwritable(temporary_.path(), errno);
}

/// First the content is made durable, then the name: after a crash there is a whole file or none.
void NewFile::publish() const {
    const std::string& temporary = temporary_.path();
    {
        const File file(temporary, O_RDONLY);
        if (file.get() < 0 || ::fsync(file.get()) != 0) raiseUnwritable(path_, errno);
    }
    SHAPEDB_FAILPOINT("backup.synced");
    fs::path folder = fs::path(path_).parent_path();
    if (folder.empty()) folder = ".";
    const File directory(folder.string(), O_RDONLY | O_DIRECTORY);
    if (directory.get() < 0) raiseUnwritable(path_, errno);
    if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) != 0) {
        if (errno == EEXIST) raiseExists(path_);
        // EINVAL: the file system does not know the flag.
        if (errno != EINVAL) raiseUnwritable(path_, errno);
        if (fs::exists(path_)) raiseExists(path_);
        if (::rename(temporary.c_str(), path_.c_str()) != 0) raiseUnwritable(path_, errno);
    }
    SHAPEDB_FAILPOINT("backup.named");
    if (::fsync(directory.get()) != 0) {
        const int why = errno;
        ::unlink(path_.c_str());  // nothing is left of a file that failed
        raiseUnwritable(path_, why);
    }
}

void makeEmptyDatabase(SqliteConnection& connection, std::int64_t nowMs) {
    // Only an empty file takes the page size. A crash loses a file that nobody knows yet.
    connection.execute("PRAGMA page_size=" + std::to_string(kPageSize) +
                       "; PRAGMA synchronous=OFF; PRAGMA journal_mode=MEMORY");
    migrate(connection, embeddedMigrations(), nowMs);
}

std::unique_ptr<SqliteConnection> checkedCopy(const std::string& path, const FileUse& use,
                                              const std::string& copyPath, const SqliteOptions& options,
                                              const RunContext& context) {
    requireBackupFile(path, options.path);
    // The file that the user named stays as it is; migrations change the copy.
    copyBytes(path, copyPath, context);
    SHAPEDB_FAILPOINT("restore.copied");
    requireDatabase(copyPath, path, use);
    try {
        auto copy = std::make_unique<SqliteConnection>(copyPath, OpenMode::kReadWrite, options.busyTimeoutMs);
        if (identify(*copy) != FileKind::kOurs) raiseForeign(path, use);
        prepareCopy(*copy, options, context);
        return copy;
    } catch (const Failure& failure) {
        orRaise(context.checkpoint());  // reports the caller's reason instead of SQLite's "interrupted"
        throw blamed(failure, path, use);
    }
}

void requireSound(SqliteConnection& connection, const SqliteOptions& options, const RunContext& context) {
    const std::vector<std::string> problems =
        checkDatabase(connection, {kMostCountedInFiles, options.acceptParameters}, context);
    if (problems.empty()) return;
    raise(ErrorCode::kDataLoss,
          problems.front() +
              (problems.size() > 1 ? " (and " + std::to_string(problems.size() - 1) + " more)" : ""));
}

namespace {

/// A file that a server wrote as the export of one collection: made at once, with a schema that knows
/// exports, and never opened by a server, whose first act is a counted change.
constexpr char kIsExport[] =
    "SELECT (SELECT commits FROM tally) = 0 AND (SELECT count(*) FROM collection) = 1 "
    "AND (SELECT count(DISTINCT applied_at) FROM schema_migration WHERE number <= 5) = 1";

}  // namespace

void requireWholeBackup(SqliteConnection& copy, const std::string& path) {
    if (copy.integer(kIsExport) == 0) return;
    raise(
        ErrorCode::kMalformedFile,
        "'" + path + "' cannot be restored: it is the export of one collection, '" +
            copy.text("SELECT name FROM collection") +
            "', and would replace all collections; take it in beside them with 'shapedb collection import'");
}

void exportToFile(Connection& source, const Collection& collection, const NewFile& file,
                  const SqliteOptions& options, const RunContext& context) {
    SqliteConnection target(file.temporaryPath(), OpenMode::kReadWrite, options.busyTimeoutMs);
    target.execute("PRAGMA synchronous=OFF");  // `publish` makes the file durable
    makeEmptyDatabase(target, options.now());
    copyCollection(source, collection, target, options.now(), context);
    // It is too late to learn of damage when the file is needed.
    requireSound(target, options, context);
}

}  // namespace shapedb::store
