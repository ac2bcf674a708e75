// SPDX-License-Identifier: GPL-3.0-or-later
// The class behind openSqliteStore; its functions are in maintenance.cpp, index_rows.cpp, notices.cpp,
// space.cpp, transfer.cpp and sqlite_store.cpp.
//
// Lock order: importMutex_, largeScanMutex_, the reserve's mutex, writerMutex_, the pool's mutex. Nobody
// holds a reader while waiting for the writer, so that neither waits for the other.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "server/store/sql/sql_store.h"
#include "server/store/sqlite/commit_mark.h"
#include "server/store/sqlite/pool.h"
#include "server/store/sqlite/process_lock.h"
#include "server/store/sqlite/space_reserve.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::store {

/// While it lives, there is one more of those that `counter` counts.
class Counted {
  public:
    explicit Counted(std::atomic<int>& counter) : counter_(counter) { ++counter_; }
    ~Counted() { --counter_; }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;

  private:
    std::atomic<int>& counter_;
};

/// The connection that this store has handed to a piece of work.
inline SqliteConnection& ours(Connection& connection) { return static_cast<SqliteConnection&>(connection); }

class SqliteStore final : public SqlStore {
  public:
    /// Throws Failure.
    explicit SqliteStore(const SqliteOptions& options);
    /// Closes the file so that it is whole without what is beside it.
    ~SqliteStore() override;

    Result<std::vector<Shape>> recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) override;
    Result<std::vector<IndexRow>> loadIndex(std::int64_t collectionId, std::int64_t afterId,
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
    Result<void> checkpoint() override;
    std::vector<std::string> findings() const override;
    std::size_t notices() const override;
    Result<std::vector<std::string>> acknowledge() override;

  private:
    void inWriteTransaction(Space space, const Work& work) override;
    void inReadTransaction(const Work& work) override;
    TimestampMs now() const override { return options_.now(); }
    int pointCompressionLevel() const noexcept override { return options_.pointCompressionLevel; }
    /// The reserve is held, or there are free pages.
    Result<void> requireSpace() noexcept override;
    std::vector<Collection> salvageCollections(Connection& connection, const Failure& damage) override;
    std::vector<Alias> salvageAliases(Connection& connection, const Failure& damage) override;

    void writeOnce(const Work& work);

    /// At start: tells of commits that are gone, and brings the mark up to date. Throws Failure.
    void compareCommits();
    /// Throws Failure.
    void addNotice(std::int64_t missing, const std::string& message);
    void readNotices();
    /// At start, of the small tables. Throws Failure.
    void checkSmallValues();
    /// Commits, counts the commit if anything changed since `changesBefore`, and leaves the mark.
    void commit(Transaction& transaction, std::int64_t changesBefore);

    /// A backup as it is, page by page. Throws Failure.
    void copyPages(const std::string& path, const RunContext& context) const;
    /// Adds it to the findings, once.
    void noteDamagedIndex(const std::string& damage);

    /// After a commit: keeps the write-ahead log from growing without bound. Under writerMutex_.
    void boundWal() noexcept;
    /// Writes the log back and cuts it to nothing, if no read needs it.
    void emptyLog() noexcept;
    /// Whether the database can take as much as the reserve without growing.
    bool hasFreePages() noexcept;

    SqliteOptions options_;
    std::string walPath_;
    ProcessLock lock_;
    SpaceReserve reserve_;
    std::mutex writerMutex_;
    CommitMark mark_;
    bool wasOpen_ = false;  ///< in the file, when it was found: its last server did not close it
    std::unique_ptr<SqliteConnection> writer_;
    std::unique_ptr<ReaderPool> readers_;
    std::int64_t missingCommits_ = 0;         ///< under findingsMutex_, as the next three
    std::vector<std::string> findings_;       ///< what was noticed when the database was opened
    std::vector<std::string> notices_;        ///< what waits for `acknowledge`
    std::optional<std::string> queueDamage_;  ///< of the table of jobs, found when the database was opened
    mutable std::mutex findingsMutex_;
    /// Whether damage of the file is known, of an index perhaps: then backups are copied from the tables.
    std::atomic<bool> damaged_{false};
    std::uint64_t walAttemptAt_;  ///< log size at which to wait for readers; under writerMutex_
    /// Backups, exports and checks, which hold a snapshot too long to wait for.
    std::atomic<int> longReads_{0};
};

}  // namespace shapedb::store
