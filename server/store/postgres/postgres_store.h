// SPDX-License-Identifier: GPL-3.0-or-later
// A Store on a database of PostgreSQL 15 or newer, which several servers may share: every function sees what
// others have committed, and what it returns as done is committed. Acknowledged means durable as far as the
// database is set to (synchronous_commit, replicas).
//
// Beyond Store: kUnavailable when the database cannot be reached, has not answered for `patience`, or lets
// itself only be read. When that happens while a change is being stored the message says that it may or may
// not be stored.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/cluster/lease_table.h"
#include "server/cluster/replica.h"
#include "server/store/store.h"

namespace shapedb::store {

struct PostgresOptions {
    /// As libpq takes it: "postgresql://user@host:port/database?sslmode=verify-full" or "host=...
    /// dbname=...".
    std::string uri;
    std::string password;  ///< empty: as the URI or libpq's own files say
    /// Unique among the servers that share the database, and the same after a restart: whose jobs are whose.
    std::string serverName;
    int connections = 8;            ///< at most at a time, 2 to 1,000
    int pointCompressionLevel = 1;  ///< zstd level of stored points, 1 to 19
    /// How long a job stays with a server that no longer renews its claim. At least 100 ms.
    std::chrono::milliseconds jobLease{60'000};
    std::chrono::milliseconds patience{30'000};  ///< with the database: for a connection, for a statement
    /// An flock on this path with ".lock" is held: one server for each name and data directory.
    std::string lockPath;
    /// A folder for the files that restores, imports, and checks need meanwhile: what a server that was
    /// killed leaves in it, files::prepareTemporaryDirectory removes.
    std::string temporaryFolder;
    /// As SqliteOptions.
    std::function<TimestampMs()> now;
    std::function<Result<void>(const std::string& parameters)> acceptParameters;
};

/// Applies missing migrations, in one transaction: one server at a time. Errors: kUnavailable, kSchemaTooNew,
/// kDataLoss (a migration was edited), kInvalidArgument, kStorage (a database that is not UTF-8, or older).
[[nodiscard]] Result<std::unique_ptr<Store>> openPostgresStore(const PostgresOptions& options);

/// The leases of shards in the database of a store of openPostgresStore, over one more connection; may
/// outlive it. `replicas`: slots of each shard, at least 1. Null: the store is another.
[[nodiscard]] std::unique_ptr<cluster::LeaseTable> leaseTable(Store& store, int replicas);
/// The rows of shards in the same database, over the store's connections; must not outlive it. Null: as
/// above.
[[nodiscard]] std::unique_ptr<cluster::ReplicaSource> replicaSource(Store& store);

}  // namespace shapedb::store
