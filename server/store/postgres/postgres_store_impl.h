// SPDX-License-Identifier: GPL-3.0-or-later
// The class behind openPostgresStore; its functions are in postgres_store.cpp and files.cpp.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/files/temporary_file.h"
#include "server/store/postgres/job_leases.h"
#include "server/store/postgres/pool.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sql/sql_store.h"
#include "server/store/sqlite/process_lock.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::store {

class PostgresStore final : public SqlStore {
  public:
    /// Throws Failure.
    explicit PostgresStore(const PostgresOptions& options);

    Result<std::optional<Job>> claimJob() override;
    Result<std::optional<Shape>> finishJob(const Job& job, const SignatureRow& signature) override;
    Result<std::optional<Shape>> failJob(const Job& job, const Error& why) override;
    Result<void> releaseJob(const Job& job) override;
    Result<std::vector<Shape>> recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) override;

    Result<std::vector<IndexRow>> loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                            std::size_t limit) override;
    Result<std::vector<std::optional<StoredHit>>> getHits(const std::vector<std::int64_t>& shapeIds,
                                                          bool withSignatures) override;

    bool isShared() const noexcept override { return true; }
    Result<ChangeLogs> changeLogs() override;
    Result<CollectionPosition> position(std::int64_t collectionId) override;
    Result<std::vector<Change>> changesAfter(std::int64_t collectionId, std::int64_t number,
                                             std::size_t limit) override;

    Result<void> backup(const std::string& path, const RunContext& context) override;
    Result<std::uint64_t> backupBytes() override;
    Result<void> restore(const std::string& path, const RunContext& context,
                         const std::function<Result<void>()>& replacing) override;
    Result<void> exportCollection(std::int64_t collectionId, const std::string& path,
                                  const RunContext& context) override;
    Result<Collection> importCollection(const std::string& path, const ImportRequest& request,
                                        const RunContext& context) override;
    Result<std::vector<std::string>> check(const RunContext& context) override;
    Result<StoreStats> stats() override;
    // The database looks after itself.
    Result<void> checkpoint() override { return {}; }
    std::vector<std::string> findings() const override { return {}; }
    std::size_t notices() const override { return 0; }
    Result<std::vector<std::string>> acknowledge() override { return std::vector<std::string>{}; }

    PostgresAddress address() const { return address(options_.patience); }
    PostgresPool& pool() { return pool_; }

  private:
    void inWriteTransaction(Space space, const Work& work) override;
    void inReadTransaction(const Work& work) override;
    TimestampMs now() const override { return options_.now(); }
    /// Other servers may import at the same time.
    std::string importName() const override { return ".import-" + options_.serverName; }
    int pointCompressionLevel() const noexcept override { return options_.pointCompressionLevel; }
    void lockNames(Connection& connection) override;
    void lockCollection(Connection& connection, std::int64_t collectionId) override;
    void lockCollectionsOf(Connection& connection, const std::vector<std::int64_t>& shapeIds) override;
    void logChange(Connection& connection, std::int64_t collectionId, std::int64_t shapeId) override;
    void logAll(Connection& connection, std::int64_t collectionId) override;

    /// Throws Failure.
    void migrateDatabase();
    void renew(const std::vector<std::int64_t>& jobIds);
    PostgresAddress address(std::chrono::milliseconds patience) const;
    SqliteOptions fileOptions() const;
    /// One that is removed with what this returns or, should the server die before, at its next start. Throws
    /// Failure.
    files::TemporaryFile temporaryFile() const;
    /// For long operations; `context` cancels them between rows.
    std::unique_ptr<PostgresConnection> patientConnection() const;
    /// All content, as it is now, in a new database file. Throws Failure.
    void copyToFile(const std::string& path, const char* stage, const RunContext& context);

    PostgresOptions options_;
    ProcessLock lock_;
    StatementTexts texts_;
    PostgresPool pool_;
    std::atomic<int> maxAttempts_{0};    ///< of recoverJobs; 0: not known yet
    std::unique_ptr<JobLeases> leases_;  ///< last: its thread uses the pool
};

}  // namespace shapedb::store
