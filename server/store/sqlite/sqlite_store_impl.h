// SPDX-License-Identifier: GPL-3.0-or-later
// The class behind openSqliteStore; its functions are in collections.cpp, shapes.cpp, listing.cpp, jobs.cpp,
// rebuild.cpp, maintenance.cpp, notices.cpp, space.cpp, transfer.cpp and sqlite_store.cpp.
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

#include "server/store/point_blob.h"
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

class SqliteStore final : public Store {
  public:
    /// Throws Failure.
    explicit SqliteStore(const SqliteOptions& options);
    /// Closes the file so that it is whole without what is beside it.
    ~SqliteStore() override;

    Result<Collection> createCollection(const std::string& name, const std::string& description,
                                        const std::string& parameters) override;
    Result<Collection> getCollection(const std::string& name) override;
    Result<std::vector<Collection>> listCollections() override;
    using Store::deleteCollection;
    Result<void> deleteCollection(std::int64_t collectionId, const std::function<void()>& gone) override;
    Result<Collection> renameCollection(std::int64_t collectionId, const std::string& name) override;
    Result<void> setAlias(const std::string& name, std::int64_t collectionId) override;
    Result<void> deleteAlias(const std::string& name) override;
    Result<std::vector<Alias>> listAliases() override;

    Result<PutResult> putShape(const PutRequest& request) override;
    Result<Shape> getShape(std::int64_t collectionId, const std::string& key) override;
    Result<Shape> getShapeById(std::int64_t shapeId) override;
    Result<std::vector<std::optional<Shape>>> getShapes(std::int64_t collectionId,
                                                        const std::vector<std::string>& keys) override;
    Result<std::vector<Shape>> listShapes(std::int64_t collectionId, const ShapeListing& listing,
                                          std::size_t limit, const ShapeFilter& filter) override;
    Result<std::uint64_t> countShapes(std::int64_t collectionId, const ShapeFilter& filter) override;
    Result<std::uint64_t> countWaiting(std::int64_t collectionId) override;
    Result<Shape> deleteShape(std::int64_t collectionId, const std::string& key,
                              std::optional<std::int64_t> expectedVersion) override;
    Result<std::vector<Shape>> deleteShapes(const std::vector<std::int64_t>& shapeIds,
                                            const std::function<bool(const Shape&)>& still) override;
    Result<std::vector<Shape>> changeMetadata(
        const std::vector<std::int64_t>& shapeIds,
        const std::function<std::optional<Metadata>(const Shape&)>& change) override;
    Result<StoredPoints> loadPoints(std::int64_t shapeId) override;
    Result<SignatureRow> getSignature(std::int64_t shapeId) override;
    Result<std::vector<std::optional<StoredHit>>> getHits(const std::vector<std::int64_t>& shapeIds,
                                                          bool withSignatures) override;
    Result<std::optional<SurfaceRow>> getSurface(std::int64_t shapeId) override;

    Result<std::optional<Job>> claimJob() override;
    Result<std::optional<Shape>> finishJob(const Job& job, const SignatureRow& signature) override;
    Result<std::optional<Shape>> failJob(const Job& job, const Error& why) override;
    Result<void> releaseJob(const Job& job) override;
    Result<std::vector<Shape>> recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) override;
    Result<std::uint64_t> retryShapes(const std::vector<std::int64_t>& shapeIds, std::uint64_t maxQueuedJobs,
                                      std::uint64_t maxQueuedBytes) override;
    Result<QueueDepth> queueDepth() override;

    Result<std::vector<IndexRow>> loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                            std::size_t limit) override;

    Result<Rebuild> startRebuild(std::int64_t collectionId, const std::string& parameters) override;
    Result<Rebuild> getRebuild(std::int64_t rebuildId) override;
    Result<std::vector<Rebuild>> runningRebuilds() override;
    Result<std::vector<Shape>> rebuildBatch(std::int64_t rebuildId, std::int64_t afterId,
                                            std::size_t limit) override;
    Result<void> putRebuilt(std::int64_t rebuildId, const SignatureRow& signature) override;
    Result<void> putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId, std::int64_t pointsVersion,
                                   const Error& why) override;
    Result<bool> finishRebuild(std::int64_t rebuildId) override;
    Result<void> abandonRebuild(std::int64_t rebuildId, RebuildState state) override;

    Result<void> backup(const std::string& path, const RunContext& context) override;
    Result<void> restore(const std::string& path, const RunContext& context,
                         const std::function<Result<void>()>& replacing) override;
    Result<std::uint64_t> exportBytes(std::int64_t collectionId) override;
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
    /// Runs `body(connection)` in a write transaction and commits it, unless it throws.
    template <typename Body>
    auto writeOnce(const char* operation, Body&& body) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        using Value = std::invoke_result_t<Body, Connection&>;
        return guarded(operation, [&]() -> Value {
            const std::lock_guard<std::mutex> lock(writerMutex_);
            Transaction transaction(*writer_, Transaction::Kind::kWrite);
            const std::int64_t before = writer_->totalChanges();
            if constexpr (std::is_void_v<Value>) {
                body(*writer_);
                commit(transaction, before);
            } else {
                Value value = body(*writer_);
                commit(transaction, before);
                return value;
            }
        });
    }

    /// As `writeOnce`; on a full disk a second time, if what it writes fits into free pages of the database.
    template <typename Body>
    auto write(const char* operation, Body&& body) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        auto done = writeOnce(operation, body);
        if (done || done.error().code != ErrorCode::kStorageFull || !hasFreePages()) return done;
        return onReserve(operation, body);
    }

    /// As `write`, for what frees space.
    template <typename Body>
    auto remove(const char* operation, Body&& body) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        auto done = writeOnce(operation, body);
        if (done || done.error().code != ErrorCode::kStorageFull) return done;
        return onReserve(operation, body);
    }

    /// The log gets the space of the reserve, and gives it back when it has been written back: what is
    /// written must not let the database grow.
    template <typename Body>
    auto onReserve(const char* operation, Body&& body) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        const SpaceReserve::Loan loan(reserve_);
        auto done = writeOnce(operation, body);
        emptyLog();
        return done;
    }

    /// Runs `body(connection)` in a read transaction on a pooled connection.
    template <typename Body>
    auto read(const char* operation, Body&& body) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        using Value = std::invoke_result_t<Body, Connection&>;
        return guarded(operation, [&]() -> Value {
            const ReaderPool::Lease lease = readers_->acquire();
            const Transaction snapshot(*lease, Transaction::Kind::kRead);
            return body(*lease);
        });
    }

    /// At start: tells of commits that are gone, and brings the mark up to date. Throws Failure.
    void compareCommits();
    /// Throws Failure.
    void addNotice(std::int64_t missing, const std::string& message);
    void readNotices();
    /// At start, of the small tables. Throws Failure.
    void checkSmallValues();
    /// Commits, counts the commit if anything changed since `changesBefore`, and leaves the mark.
    void commit(Transaction& transaction, std::int64_t changesBefore);

    TimestampMs now() const { return options_.now(); }

    /// Adds it to the findings, once.
    void noteDamagedIndex(const std::string& damage);

    /// After a commit: keeps the write-ahead log from growing without bound. Under writerMutex_.
    void boundWal() noexcept;
    /// Writes the log back and cuts it to nothing, if no read needs it.
    void emptyLog() noexcept;
    /// Before what lets the database grow: the reserve is held, or there are free pages. Errors:
    /// kStorageFull.
    Result<void> requireSpace() noexcept;
    /// Whether the database can take as much as the reserve without growing.
    bool hasFreePages() noexcept;

    PutResult insertShape(Connection& connection, const PutRequest& request, const PointEncoding& encoding);
    Shape replaceMetadata(Connection& connection, const Shape& existing, const Metadata& metadata);
    PutResult retryShape(Connection& connection, const PutRequest& request, const Shape& existing);
    PutResult replacePoints(Connection& connection, const PutRequest& request, const PointEncoding& encoding,
                            const Shape& existing);
    void queueJob(Connection& connection, const PutRequest& request, std::int64_t shapeId,
                  std::int64_t pointsVersion);
    std::optional<Shape> markFailed(Connection& connection, std::int64_t shapeId, const Error& why);
    /// Makes a failed shape pending and queues its job.
    void queueAgain(Connection& connection, std::int64_t shapeId, std::int64_t pointsVersion,
                    std::uint64_t bytes);
    bool jobIsCurrent(Connection& connection, const Job& job, std::int64_t generation);

    /// The first part of an import: the collection, with no shapes and a name that nobody else uses.
    Collection beginImport(const Collection& wanted);
    /// The last part of an import: its name and its jobs.
    Collection finishImport(const Collection& imported);
    void importShapes(Connection& file, const Collection& from, const Collection& to,
                      const ImportRequest& request, const RunContext& context);
    /// Removes what an import has stored, some shapes at a time, if it was not completed.
    Result<void> dropImport() noexcept;
    /// The same for collections that were deleted.
    Result<void> dropDeleted() noexcept;
    /// Removes the collections that `statement` finds, which are hidden.
    Result<void> dropHidden(const char* operation, const char* statement) noexcept;

    SqliteOptions options_;
    std::string walPath_;
    ProcessLock lock_;
    SpaceReserve reserve_;
    std::mutex importMutex_;     ///< one import at a time
    std::mutex largeScanMutex_;  ///< one compressed copy of a large scan at a time, to bound memory
    std::mutex writerMutex_;
    CommitMark mark_;
    bool wasOpen_ = false;  ///< in the file, when it was found: its last server did not close it
    std::unique_ptr<Connection> writer_;
    std::unique_ptr<ReaderPool> readers_;
    std::int64_t missingCommits_ = 0;         ///< under findingsMutex_, as the next three
    std::vector<std::string> findings_;       ///< what was noticed when the database was opened
    std::vector<std::string> notices_;        ///< what waits for `acknowledge`
    std::optional<std::string> queueDamage_;  ///< of the table of jobs, found when the database was opened
    mutable std::mutex findingsMutex_;
    std::uint64_t walAttemptAt_;  ///< log size at which to wait for readers; under writerMutex_
    /// Backups, exports and checks, which hold a snapshot too long to wait for.
    std::atomic<int> longReads_{0};
};

}  // namespace shapedb::store
