// SPDX-License-Identifier: GPL-3.0-or-later
// Backup, restore and check.
#include <algorithm>

#include "server/store/failpoints.h"
#include "server/store/sql/rows.h"
#include "server/store/sqlite/check.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/database_file.h"
#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/row_copy.h"
#include "server/store/sqlite/sequences.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

/// 1 MiB between two checks for cancellation.
constexpr int kStepPages = 256;

bool contains(const std::vector<std::string>& lines, const std::string& line) {
    return std::find(lines.begin(), lines.end(), line) != lines.end();
}

/// No server has given out this many ids since the backup was made; used where the last id is unknown.
constexpr std::int64_t kBeyondUnknownIds = std::int64_t{1} << 40;

/// Ids are never reused, not even across a restore: new rows continue after both histories, and jobs
/// and rebuilds of the file get ids that the running server has never given out, so that a result in
/// flight cannot meet the wrong row.
/// Returns how many commits the copy counts then.
///
/// A restore is the way out of damage: what cannot be read of the live database must not stop it.
std::int64_t separateIds(SqliteConnection& copy, SqliteConnection& live, std::int64_t marked) {
    std::int64_t commits = countCommits(copy);
    const auto believe = [&](std::int64_t count) {
        if (count <= kMostCounted) commits = std::max(commits, count);
    };
    const bool counted = unlessDamaged([&] { believe(countCommits(live)); });
    if (!counted) believe(marked);
    ++commits;
    const auto lastOfBoth = [&](const std::string& table) {
        std::int64_t last = lastId(copy, table);
        const bool readable = unlessDamaged([&] { last = std::max(last, lastId(live, table)); });
        return readable ? last : last + kBeyondUnknownIds;
    };
    Transaction transaction(copy, Transaction::Kind::kWrite);
    for (const char* table : {"collection", "shape"}) setLastId(copy, table, lastOfBoth(table));
    // Not moved by an offset: ids would double with every restore of what was restored before.
    for (const std::string table : {"job", "rebuild"}) renumber(copy, table, lastOfBoth(table));
    // No mark of an acknowledged change is ahead of the database that replaces this one.
    copy.execute("UPDATE tally SET commits = " + std::to_string(commits));
    // Of the history of another database.
    copy.execute("DELETE FROM notice");
    // The server that made the backup did not die of the jobs it was running.
    copy.execute("UPDATE job SET state = 0, attempts = attempts - 1 WHERE state = 1");
    transaction.commit();
    return commits;
}

}  // namespace

Result<void> SqliteStore::backup(const std::string& path, const RunContext& context) {
    return guarded("write the backup", [&] {
        const NewFile file(path);
        SHAPEDB_FAILPOINT("backup.file");
        const Counted longRead(longReads_);
        if (!damaged_ || !copyRows(options_.path, file.temporaryPath(), options_, context))
            copyPages(file.temporaryPath(), context);
        SHAPEDB_FAILPOINT("backup.closed");
        file.publish();
        SHAPEDB_FAILPOINT("backup.durable");
    });
}

void SqliteStore::copyPages(const std::string& path, const RunContext& context) const {
    SqliteConnection source(options_.path, OpenMode::kReadOnly, options_.busyTimeoutMs);
    // Without an open snapshot every write would make SQLite restart the copy.
    const Transaction snapshot(source, Transaction::Kind::kRead);
    static_cast<void>(source.integer("SELECT count(*) FROM sqlite_schema"));
    SqliteConnection target(path, OpenMode::kReadWrite, options_.busyTimeoutMs);
    target.execute("PRAGMA synchronous=OFF");  // the file is made durable when it gets its name
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

Result<void> SqliteStore::restore(const std::string& path, const RunContext& context,
                                  const std::function<Result<void>()>& replacing) {
    return guarded("restore the backup", [&] {
        const TemporaryDatabase temporary(options_.path + ".restore");
        const auto copy = checkedCopy(path, kRestored, temporary.path(), options_, context);
        requireWholeBackup(*copy, path);
        // Until the end: no id may be given out between reading the last ones and replacing the tables.
        const std::lock_guard<std::mutex> lock(writerMutex_);
        SHAPEDB_FAILPOINT("restore.checked");
        const std::int64_t commits = separateIds(*copy, *writer_, mark_.read().value_or(0));
        SHAPEDB_FAILPOINT("restore.separated");
        if (replacing) orRaise(replacing());
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
            notices_.clear();
            queueDamage_.reset();
        }
        damaged_ = false;
        boundWal();
    });
}

Result<std::vector<std::string>> SqliteStore::check(const RunContext& context) {
    return guarded("check the database", [&] {
        const Counted longRead(longReads_);
        SqliteConnection connection(options_.path, OpenMode::kReadOnly, options_.busyTimeoutMs);
        std::vector<std::string> problems = findings();
        std::vector<std::string> found =
            checkDatabase(connection, {kMostCounted, options_.acceptParameters}, context);
        if (!found.empty()) damaged_ = true;
        for (std::string& problem : found)
            if (!contains(problems, problem)) problems.push_back(std::move(problem));
        return problems;
    });
}

}  // namespace shapedb::store
