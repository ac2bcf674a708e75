// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/postgres_store.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/store/postgres/index_page.h"
#include "server/store/postgres/lease_table.h"
#include "server/store/postgres/postgres_store_impl.h"
#include "server/store/postgres/replica_source.h"
#include "server/store/postgres/statement.h"
#include "server/store/postgres/statements.h"
#include "server/store/postgres/transactions.h"
#include "server/store/sql/migration.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql.h"

namespace shapedb::store {

const std::vector<Migration>& embeddedPostgresMigrations();

namespace {

// Keys of advisory locks: nobody else uses this database.
constexpr char kLockMigration[] = "SELECT pg_advisory_xact_lock(1399350340)";
// Who changes names locks the row of the directory, and counts.
constexpr char kLockNames[] = "UPDATE directory SET last_change = last_change + 1";
constexpr char kLockCollection[] = "SELECT id FROM collection WHERE id = ?1 FOR NO KEY UPDATE";
constexpr char kCollectionOfShape[] = "SELECT collection_id FROM shape WHERE id = ?1";
// Its row is locked: numbers appear in the order in which they are given out.
constexpr char kLogChange[] =
    "WITH next AS (UPDATE collection SET last_change = last_change + 1 WHERE id = ?1 RETURNING id, "
    "last_change) "
    "INSERT INTO change (collection_id, number, shape_id) SELECT id, last_change, CAST(?2 AS BIGINT) FROM "
    "next RETURNING number";
constexpr char kLogAll[] =
    "WITH next AS (UPDATE collection SET last_change = last_change + 1 WHERE id = ?1 RETURNING id, "
    "last_change) "
    "INSERT INTO change (collection_id, number) SELECT id, last_change FROM next";
constexpr char kForgetChanges[] =
    "DELETE FROM change WHERE collection_id = ?1 AND number <= (SELECT last_change FROM collection WHERE id "
    "= ?1) - ?2";
constexpr char kDirectory[] = "SELECT last_change FROM directory";
constexpr char kLastChanges[] = "SELECT id, last_change FROM collection";
// Of many shapes at once: each statement is a round trip.
constexpr char kShapesOfHits[] = "SELECT " SHAPEDB_SHAPE_COLUMNS SHAPEDB_FROM_SHAPE
                                 "WHERE s.id = ANY(string_to_array(?1, ',')::bigint[]) ORDER BY s.id";
constexpr char kSignaturesOfHits[] =
    "SELECT s.id, g.points_version, g.generation, g.digest, g.bytes, g.views FROM shape s JOIN collection c "
    "ON c.id = s.collection_id JOIN signature g ON g.shape_id = s.id AND g.generation = c.generation WHERE "
    "s.id = ANY(string_to_array(?1, ',')::bigint[])";
constexpr char kPosition[] = "SELECT last_change, generation FROM collection WHERE id = ?1";
constexpr char kChangesAfter[] =
    "SELECT number, shape_id FROM change WHERE collection_id = ?1 AND number > ?2 ORDER BY number LIMIT ?3";
// As what recoverJobs does with those of a process that was stopped: they run after all other jobs.
constexpr char kQueueLostJobs[] =
    "UPDATE job SET state = 0, attempts = attempts - 1, stops = stops + 1, owner = NULL, lease_end = NULL "
    "WHERE id IN "
    "(SELECT id FROM job WHERE state = 1 AND lease_end < clock_timestamp() FOR UPDATE SKIP LOCKED)";
// What is not worth waiting for a standby: see the leases of shards.
constexpr char kCommitHere[] = "SELECT set_config('synchronous_commit', 'local', true)";
constexpr char kDatabaseBytes[] = "SELECT pg_database_size(current_database())";
constexpr char kSchemaVersion[] = "SELECT max(number) FROM schema_migration";
constexpr char kCreateRecord[] =
    "CREATE TABLE IF NOT EXISTS schema_migration (number bigint PRIMARY KEY, name text NOT NULL, sha256 text "
    "NOT "
    "NULL, applied_at bigint NOT NULL)";

/// Of a collection. A server that is further behind loads it again.
constexpr std::int64_t kChangesKept = 10'000;
/// Changes after which the oldest are forgotten.
constexpr std::int64_t kForgetEvery = 256;

constexpr int kOldestServer = 150'000;
constexpr std::size_t kMostServerName = 63;

PostgresOptions completed(PostgresOptions options) {
    if (options.uri.empty()) raise(ErrorCode::kInvalidArgument, "the URI of the database is empty");
    orRaise(checkUri(options.uri));
    if (options.serverName.empty() || options.serverName.size() > kMostServerName) {
        raise(ErrorCode::kInvalidArgument, "the name of the server must have 1 to 63 bytes");
    }
    if (options.connections < 2 || options.connections > 1'000) {
        raise(ErrorCode::kInvalidArgument,
              "connections must be 2 to 1,000, not " + std::to_string(options.connections));
    }
    requireCompressionLevel(options.pointCompressionLevel);
    if (options.jobLease < std::chrono::milliseconds(100)) {
        raise(ErrorCode::kInvalidArgument, "the lease of a job must be at least 100 ms");
    }
    if (!options.now) options.now = systemNow;
    return options;
}

/// That its version and encoding will do.
void requireServer(PostgresConnection& connection) {
    const std::string version = connection.text("SHOW server_version_num");
    if (std::stoi(version) < kOldestServer) {
        raise(ErrorCode::kStorage, "the database server has version " + version + "; 15 or newer is needed");
    }
    const std::string encoding = connection.text("SHOW server_encoding");
    if (encoding != "UTF8") {
        raise(ErrorCode::kStorage,
              "the database has the encoding " + encoding + "; create one with ENCODING 'UTF8'");
    }
}

}  // namespace

PostgresStore::PostgresStore(const PostgresOptions& options)
    : options_(completed(options)),
      lock_(options_.lockPath),
      texts_(postgresStatements(options_.serverName, options_.jobLease)),
      pool_(address(), texts_, options_.connections) {
    migrateDatabase();
    leases_ = std::make_unique<JobLeases>(options_.jobLease,
                                          [this](const std::vector<std::int64_t>& jobIds) { renew(jobIds); });
    // What this server left when it died, and what any server has deleted: no client sees it.
    static_cast<void>(dropImport());
    static_cast<void>(dropDeleted());
}

PostgresAddress PostgresStore::address(std::chrono::milliseconds patience) const {
    return {options_.uri, options_.password, patience, options_.serverName};
}

void PostgresStore::migrateDatabase() {
    requireServer(*pool_.acquire(PostgresPool::Use::kRead));
    // One that writes a large table anew takes its time, and so does another server's.
    const auto connection = patientConnection();
    Transaction transaction(*connection, Transaction::Kind::kWrite);
    Query(*connection, kLockMigration).run();
    connection->execute(kCreateRecord);
    const auto& migrations = embeddedPostgresMigrations();
    for (std::size_t i = verifyMigrations(*connection, migrations); i < migrations.size(); ++i) {
        connection->execute(migrations[i].sql);
        recordMigration(*connection, migrations[i], now());
    }
    transaction.commit();
}

// Transactions -------------------------------------------------------------------------------

void PostgresStore::inWriteTransaction(Space space, const Work& work) {
    store::inWriteTransaction(pool_, space == Space::kTakesOnce, work);
}

void PostgresStore::inReadTransaction(const Work& work) { store::inReadTransaction(pool_, work); }

void PostgresStore::lockNames(Connection& connection) { Query(connection, kLockNames).run(); }

void PostgresStore::lockCollection(Connection& connection, std::int64_t collectionId) {
    Query(connection, kLockCollection, collectionId).run();
}

void PostgresStore::lockCollectionsOf(Connection& connection, const std::vector<std::int64_t>& shapeIds) {
    std::set<std::int64_t> collections;
    for (const std::int64_t id : shapeIds) {
        collections.insert(numberOf(Query(connection, kCollectionOfShape, id)));
    }
    for (const std::int64_t id : collections) lockCollection(connection, id);
}

void PostgresStore::logChange(Connection& connection, std::int64_t collectionId, std::int64_t shapeId) {
    const std::int64_t number = numberOf(Query(connection, kLogChange, collectionId, shapeId));
    if (number % kForgetEvery == 0) Query(connection, kForgetChanges, collectionId, kChangesKept).run();
}

void PostgresStore::logAll(Connection& connection, std::int64_t collectionId) {
    Query(connection, kLogAll, collectionId).run();
}

Result<std::vector<IndexRow>> PostgresStore::loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                       std::size_t limit) {
    return read("load the index", [&](Connection& connection) {
        std::vector<IndexRow> rows;
        const std::int64_t generation = requireCollection(connection, collectionId).generation;
        IndexPage page;
        page.upTo = afterId;
        while (rows.size() < limit && !page.last) {
            page = readIndexPage(connection, collectionId, generation, cluster::ShardSet().set(), page.upTo,
                                 limit - rows.size());
            std::move(page.rows.begin(), page.rows.end(), std::back_inserter(rows));
        }
        return rows;
    });
}

Result<std::vector<std::optional<StoredHit>>> PostgresStore::getHits(
    const std::vector<std::int64_t>& shapeIds, bool withSignatures) {
    std::map<std::int64_t, StoredHit> found;
    const auto done = read("read the hits", [&](Connection& connection) {
        found.clear();  // it may be done a second time
        const std::string ids = listed(shapeIds);
        Query shapes(connection, kShapesOfHits, ids);
        forEachShape(shapes, [&](Shape&& shape) {
            const std::int64_t id = shape.id;
            found.emplace(id, StoredHit{std::move(shape), fail(ErrorCode::kNotReady, "not asked for")});
            return true;
        });
        if (!withSignatures) return;
        Query signatures(connection, kSignaturesOfHits, ids);
        while (signatures.step()) {
            const std::int64_t id = signatures.integer(0);
            found.at(id).signature =
                guarded("read the signature", [&] { return readSignature(connection, signatures, 1, id); });
        }
    });
    RETURN_IF_ERROR(done);
    std::vector<std::optional<StoredHit>> hits(shapeIds.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const auto hit = found.find(shapeIds[i]);
        if (hit == found.end()) continue;
        hits[i] = hit->second;
        const auto& signature = hits[i]->signature;
        // Why it has none.
        const bool missing = withSignatures && !signature && signature.error().code == ErrorCode::kNotReady;
        if (missing) hits[i]->signature = getSignature(shapeIds[i]);
    }
    return hits;
}

Result<ChangeLogs> PostgresStore::changeLogs() {
    return read("read how far the logs of changes go", [](Connection& connection) {
        ChangeLogs logs;
        logs.directory = numberOf(Query(connection, kDirectory));
        Query query(connection, kLastChanges);
        while (query.step()) logs.last.emplace(query.integer(0), query.integer(1));
        return logs;
    });
}

Result<CollectionPosition> PostgresStore::position(std::int64_t collectionId) {
    return read("read where a collection stands", [&](Connection& connection) {
        Query query(connection, kPosition, collectionId);
        if (!query.step()) {
            raise(ErrorCode::kNotFound, "there is no collection " + std::to_string(collectionId));
        }
        return CollectionPosition{query.integer(0), query.integer(1)};
    });
}

Result<std::vector<Change>> PostgresStore::changesAfter(std::int64_t collectionId, std::int64_t number,
                                                        std::size_t limit) {
    return read("read the log of changes", [&](Connection& connection) {
        std::vector<Change> changes;
        Query query(connection, kChangesAfter, collectionId, number, limit);
        while (query.step()) {
            Change& change = changes.emplace_back();
            change.number = query.integer(0);
            if (!query.isNull(1)) change.shapeId = query.integer(1);
        }
        return changes;
    });
}

// Jobs ---------------------------------------------------------------------------------------

Result<std::optional<Job>> PostgresStore::claimJob() {
    while (true) {
        auto job = SqlStore::claimJob();
        if (!job || !*job) return job;
        leases_->add((*job)->id);
        // It may be what stops its workers, which nobody may have started again.
        const int most = maxAttempts_;
        const Deaths deaths{(*job)->attempts - 1, (*job)->stops};
        if (most == 0 || !isQuarantined(deaths, most)) return job;
        RETURN_IF_ERROR(failJob(**job, quarantineError(deaths)));
    }
}

Result<std::optional<Shape>> PostgresStore::finishJob(const Job& job, const SignatureRow& signature) {
    auto done = SqlStore::finishJob(job, signature);
    leases_->remove(job.id);
    return done;
}

Result<std::optional<Shape>> PostgresStore::failJob(const Job& job, const Error& why) {
    auto done = SqlStore::failJob(job, why);
    leases_->remove(job.id);
    return done;
}

Result<void> PostgresStore::releaseJob(const Job& job) {
    auto done = SqlStore::releaseJob(job);
    leases_->remove(job.id);
    return done;
}

Result<std::vector<Shape>> PostgresStore::recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) {
    maxAttempts_ = maxAttempts;
    return SqlStore::recoverJobs(maxAttempts, crashes);
}

void PostgresStore::renew(const std::vector<std::int64_t>& jobIds) {
    static_cast<void>(guarded("renew the claims of jobs", [&] {
        // Not one of those for writes: these may all wait for another transaction, and this one does not.
        const PostgresPool::Lease connection = pool_.acquire(PostgresPool::Use::kRead);
        const auto withoutStandby = [&](const std::function<void()>& work) {
            Transaction transaction(*connection, Transaction::Kind::kWrite);
            Query(*connection, kCommitHere).run();
            work();
            transaction.commit();
        };
        withoutStandby([&] { Query(*connection, kQueueLostJobs).run(); });
        if (jobIds.empty()) return;
        withoutStandby([&] {
            connection->execute("UPDATE job SET lease_end = clock_timestamp() + interval '" +
                                std::to_string(options_.jobLease.count()) +
                                " milliseconds' WHERE state = 1 AND owner = " +
                                sqlLiteral(options_.serverName) + " AND id IN (" + listed(jobIds) + ")");
        });
    }));
}

// Statistics ---------------------------------------------------------------------------------

Result<StoreStats> PostgresStore::stats() {
    return read("read the statistics", [&](Connection& connection) {
        StoreStats stats = readStats(connection);
        stats.databaseBytes = static_cast<std::uint64_t>(numberOf(Query(connection, kDatabaseBytes)));
        stats.schemaVersion = static_cast<int>(numberOf(Query(connection, kSchemaVersion)));
        return stats;
    });
}

Result<std::uint64_t> PostgresStore::backupBytes() {
    return read("read the size of the database", [](Connection& connection) {
        return static_cast<std::uint64_t>(numberOf(Query(connection, kDatabaseBytes)));
    });
}

Result<std::unique_ptr<Store>> openPostgresStore(const PostgresOptions& options) {
    return guarded("open the database",
                   [&]() -> std::unique_ptr<Store> { return std::make_unique<PostgresStore>(options); });
}

std::unique_ptr<cluster::LeaseTable> leaseTable(Store& store, int replicas) {
    const auto* postgres = dynamic_cast<const PostgresStore*>(&store);
    if (postgres == nullptr) return nullptr;
    return std::make_unique<PostgresLeaseTable>(postgres->address(), replicas);
}

std::unique_ptr<cluster::ReplicaSource> replicaSource(Store& store) {
    auto* postgres = dynamic_cast<PostgresStore*>(&store);
    if (postgres == nullptr) return nullptr;
    return std::make_unique<PostgresReplicaSource>(postgres->pool());
}

}  // namespace shapedb::store
