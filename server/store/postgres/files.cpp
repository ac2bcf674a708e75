// SPDX-License-Identifier: GPL-3.0-or-later
// Backups, exports and imports: the same files as those of a database in a file, so that a collection, or all
// of them, can move from one kind to the other and back.
#include <algorithm>

#include "server/store/postgres/postgres_store_impl.h"
#include "server/store/sql/collection_copy.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/table_copy.h"
#include "server/store/sqlite/check.h"
#include "server/store/sqlite/database_file.h"
#include "server/store/sqlite/sequences.h"

namespace shapedb::store {

namespace {

constexpr int kBusyTimeoutMs = 5'000;
/// A statement over all rows of a large database.
constexpr std::chrono::hours kPatient{6};
constexpr const char* kNumbered[] = {"collection", "shape", "job", "rebuild"};

// Nobody else writes from here on; who reads goes on.
constexpr char kLockAll[] = "LOCK TABLE collection, shape, job, rebuild IN EXCLUSIVE MODE";
// What the sums of each collection must be.
#define SHAPEDB_COUNTED                                                                                     \
    "(SELECT c.id, "                                                                                        \
    "(SELECT count(*) FROM shape s WHERE s.collection_id = c.id AND s.state = 0 AND NOT EXISTS (SELECT 1 "  \
    "FROM signature g WHERE g.shape_id = s.id AND g.generation = c.generation)) AS waiting, "               \
    "(SELECT count(*) FROM job j JOIN shape s ON s.id = j.shape_id WHERE s.collection_id = c.id) AS jobs, " \
    "(SELECT coalesce(sum(j.point_bytes), 0) FROM job j JOIN shape s ON s.id = j.shape_id WHERE "           \
    "s.collection_id = c.id) AS job_bytes, "                                                                \
    "(SELECT coalesce(sum(p.point_bytes), 0) FROM shape_points p JOIN shape s ON s.id = p.shape_id WHERE "  \
    "s.collection_id = c.id) AS point_bytes, "                                                              \
    "(SELECT coalesce(sum(p.stored_bytes), 0) FROM shape_points p JOIN shape s ON s.id = p.shape_id WHERE " \
    "s.collection_id = c.id) AS stored_point_bytes FROM collection c) counted"

// The sums are counted once all rows are there: one row that is changed by every other of a transaction
// becomes slow to find.
constexpr char kDeleteAll[] =
    "ALTER TABLE shape DISABLE TRIGGER USER; ALTER TABLE signature DISABLE TRIGGER USER; "
    "ALTER TABLE job DISABLE TRIGGER USER; ALTER TABLE shape_points DISABLE TRIGGER USER; "
    "DELETE FROM collection";
constexpr char kCountAgain[] =
    "ALTER TABLE shape ENABLE TRIGGER USER; ALTER TABLE signature ENABLE TRIGGER USER; "
    "ALTER TABLE job ENABLE TRIGGER USER; ALTER TABLE shape_points ENABLE TRIGGER USER; "
    "UPDATE collection SET waiting = counted.waiting, jobs = counted.jobs, job_bytes = counted.job_bytes, "
    "point_bytes = counted.point_bytes, stored_point_bytes = counted.stored_point_bytes FROM " SHAPEDB_COUNTED
    " WHERE counted.id = collection.id";
constexpr char kWrongSums[] =
    "SELECT k.id, k.waiting <> counted.waiting, (k.jobs, k.job_bytes, k.point_bytes, k.stored_point_bytes) "
    "<> "
    "(counted.jobs, counted.job_bytes, counted.point_bytes, counted.stored_point_bytes) FROM collection k "
    "JOIN " SHAPEDB_COUNTED " ON counted.id = k.id ORDER BY k.id";
/// Other servers load all collections again: no number is one that a collection had before.
constexpr char kLastOfAllChanges[] = "SELECT coalesce(max(last_change), 0) FROM collection";
constexpr std::int64_t kBeyondLog = 1'000'000;

std::int64_t lastIdOf(PostgresConnection& connection, const std::string& table) {
    const std::string last =
        connection.text("SELECT pg_sequence_last_value(pg_get_serial_sequence('" + table + "', 'id'))");
    return last.empty() ? 0 : std::stoll(last);
}

void setLastIdOf(PostgresConnection& connection, const std::string& table, std::int64_t id) {
    if (id < 1) return;
    static_cast<void>(connection.text("SELECT setval(pg_get_serial_sequence('" + table + "', 'id'), " +
                                      std::to_string(id) + ")"));
}

}  // namespace

SqliteOptions PostgresStore::fileOptions() const {
    SqliteOptions options;
    options.busyTimeoutMs = kBusyTimeoutMs;
    options.now = options_.now;
    options.acceptParameters = options_.acceptParameters;
    return options;
}

files::TemporaryFile PostgresStore::temporaryFile() const {
    return orRaise(files::TemporaryFile::create(options_.temporaryFolder));
}

std::unique_ptr<PostgresConnection> PostgresStore::patientConnection() const {
    return std::make_unique<PostgresConnection>(address(kPatient), texts_);
}

void PostgresStore::copyToFile(const std::string& path, const char* stage, const RunContext& context) {
    SqliteConnection target(path, OpenMode::kReadWriteCreate, kBusyTimeoutMs);
    target.execute("PRAGMA synchronous=OFF");  // who keeps the file makes it durable
    makeEmptyDatabase(target, now());
    const auto source = patientConnection();
    const Transaction snapshot(*source, Transaction::Kind::kRead);
    Transaction transaction(target, Transaction::Kind::kWrite);
    copyAllTables(*source, target, stage, context);
    // Only the export of one collection has none.
    target.execute("UPDATE tally SET commits = 1");
    transaction.commit();
    // Ids that were given out and are not in use any more are not given out again after a restore.
    for (const char* table : kNumbered) {
        setLastId(target, table, std::max(lastId(target, table), lastIdOf(*source, table)));
    }
}

Result<void> PostgresStore::backup(const std::string& path, const RunContext& context) {
    return guarded("write the backup", [&] {
        const NewFile file(path);
        copyToFile(file.temporaryPath(), "backup", context);
        file.publish();
    });
}

Result<std::vector<std::string>> PostgresStore::check(const RunContext& context) {
    return guarded("check the database", [&] {
        // The database checks its own files; what is in them is checked as a backup is.
        const files::TemporaryFile copy = temporaryFile();
        copyToFile(copy.path(), "integrity", context);
        SqliteConnection connection(copy.path(), OpenMode::kReadOnly, kBusyTimeoutMs);
        auto problems = checkDatabase(connection, {kMostCounted, options_.acceptParameters}, context);
        const auto source = patientConnection();
        const Transaction snapshot(*source, Transaction::Kind::kRead);
        // The copy counts anew.
        Query sums(*source, kWrongSums);
        while (sums.step()) {
            const std::string row = "table collection, row " + sums.text(0);
            if (sums.integer(1) != 0) problems.push_back(row + " has a wrong count of waiting shapes");
            if (sums.integer(2) != 0) problems.push_back(row + " has wrong sums of jobs or points");
        }
        return problems;
    });
}

Result<void> PostgresStore::restore(const std::string& path, const RunContext& context,
                                    const std::function<Result<void>()>& replacing) {
    return guarded("restore the backup", [&] {
        const files::TemporaryFile temporary = temporaryFile();
        const auto copy = checkedCopy(path, kRestored, temporary.path(), fileOptions(), context);
        requireWholeBackup(*copy, path);
        const auto live = patientConnection();
        Transaction transaction(*live, Transaction::Kind::kWrite);
        lockNames(*live);
        live->execute(kLockAll);
        std::int64_t last[std::size(kNumbered)];
        for (std::size_t i = 0; i < std::size(kNumbered); ++i) {
            last[i] = std::max(lastId(*copy, kNumbered[i]), lastIdOf(*live, kNumbered[i]));
        }
        {
            Transaction renumbering(*copy, Transaction::Kind::kWrite);
            // A result in flight must not meet the job or the rebuild of another history.
            renumber(*copy, "job", last[2]);
            renumber(*copy, "rebuild", last[3]);
            renumbering.commit();
            for (std::size_t i = 2; i < std::size(kNumbered); ++i) last[i] = lastId(*copy, kNumbered[i]);
        }
        if (replacing) orRaise(replacing());
        const std::int64_t changes = std::stoll(live->text(kLastOfAllChanges)) + kBeyondLog;
        live->execute(kDeleteAll);
        {
            const Transaction reading(*copy, Transaction::Kind::kRead);
            copyAllTables(*copy, *live, "restore", context);
        }
        live->execute(kCountAgain);
        live->execute("UPDATE collection SET last_change = " + std::to_string(changes));
        for (std::size_t i = 0; i < std::size(kNumbered); ++i) setLastIdOf(*live, kNumbered[i], last[i]);
        transaction.commit();
    });
}

Result<void> PostgresStore::exportCollection(std::int64_t collectionId, const std::string& path,
                                             const RunContext& context) {
    return guarded("export the collection", [&] {
        const NewFile file(path);
        const auto source = patientConnection();
        const Transaction snapshot(*source, Transaction::Kind::kRead);
        exportToFile(*source, requireCollection(*source, collectionId), file, fileOptions(), context);
        file.publish();
    });
}

Result<Collection> PostgresStore::importCollection(const std::string& path, const ImportRequest& request,
                                                   const RunContext& context) {
    std::optional<files::TemporaryFile> temporary;
    return importFrom(
        [&]() -> std::unique_ptr<Connection> {
            temporary.emplace(temporaryFile());
            return checkedCopy(path, kImported, temporary->path(), fileOptions(), context);
        },
        path, request, context);
}

}  // namespace shapedb::store
