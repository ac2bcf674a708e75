// SPDX-License-Identifier: GPL-3.0-or-later
// Database files other than the live one: made for a client, or received and not to be trusted.
// Functions throw Failure.
#pragma once

#include <memory>
#include <string>

#include "core/base/run_context.h"
#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::store {

/// A path at which a database may be made; it and the files that SQLite may put beside it are removed before
/// and after.
class TemporaryDatabase {
  public:
    explicit TemporaryDatabase(const std::string& path)
        : paths_{path, path + "-journal", path + "-wal", path + "-shm"} {
        remove();
    }
    ~TemporaryDatabase() { remove(); }
    TemporaryDatabase(const TemporaryDatabase&) = delete;
    TemporaryDatabase& operator=(const TemporaryDatabase&) = delete;
    [[nodiscard]] const std::string& path() const { return paths_.front(); }

  private:
    void remove() const noexcept;

    std::array<std::string, 4> paths_;  ///< made at once: removing must not need memory
};

/// A file that appears under its name when it is complete and durable, and never replaces another.
class NewFile {
  public:
    /// Creates it, empty and private, under a temporary name. Throws Failure kAlreadyExists (`path`),
    /// kFileNotWritable, kStorageFull.
    explicit NewFile(const std::string& path);
    [[nodiscard]] const std::string& temporaryPath() const { return temporary_.path(); }
    /// No connection may be open. Throws Failure as the constructor.
    void publish() const;

  private:
    std::string path_;
    TemporaryDatabase temporary_;
};

/// Gives an empty file the schema of this program.
void makeEmptyDatabase(SqliteConnection& connection, std::int64_t nowMs);

/// How messages say what a file was to be used for.
struct FileUse {
    const char* done;     ///< completes "cannot be ..."
    const char* foreign;  ///< of a file of something else
};
inline constexpr FileUse kRestored{"restored", "is no backup of ShapeDB"};
inline constexpr FileUse kImported{"imported", "is no export of ShapeDB"};

/// A copy at `copyPath` of a file that somebody named, with the schema of this program and no problem that
/// `check` finds; an unfinished import is gone. The file itself is left alone. Reports "copy" (bytes),
/// "integrity" and "points". Throws Failure kFileNotReadable, kMalformedFile, kSchemaTooNew (naming `path`),
/// kCancelled, kDeadlineExceeded.
[[nodiscard]] std::unique_ptr<SqliteConnection> checkedCopy(const std::string& path, const FileUse& use,
                                                            const std::string& copyPath,
                                                            const SqliteOptions& options,
                                                            const RunContext& context);

/// Throws Failure kMalformedFile, naming `path`, if the database is the export of one collection.
void requireWholeBackup(SqliteConnection& copy, const std::string& path);

/// Fills the file with one collection as `source` shows it; no connection to it is left open. Reports the
/// stages "export" (shapes), "integrity", "points". Throws Failure.
void exportToFile(Connection& source, const Collection& collection, const NewFile& file,
                  const SqliteOptions& options, const RunContext& context);

/// Throws Failure kDataLoss, with the first problem that `check` finds in a file.
void requireSound(SqliteConnection& connection, const SqliteOptions& options, const RunContext& context);

}  // namespace shapedb::store
