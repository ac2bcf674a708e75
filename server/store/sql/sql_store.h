// SPDX-License-Identifier: GPL-3.0-or-later
// The part of a store that is the same in every database that speaks SQL; its functions are in
// collections.cpp, shapes.cpp, listing.cpp, jobs.cpp and rebuild.cpp. A kind of database adds how
// transactions are run, and what it does in a way of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "server/store/point_blob.h"
#include "server/store/sql/connection.h"
#include "server/store/store.h"

namespace shapedb::store {

/// The source of timestamps where options name none.
[[nodiscard]] TimestampMs systemNow();
/// 1 to 19, else throws Failure kInvalidArgument.
void requireCompressionLevel(int level);

class SqlStore : public Store {
  public:
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

    Result<std::uint64_t> exportBytes(std::int64_t collectionId) override;

  protected:
    using Work = std::function<void(Connection&)>;

    /// What a write does to the space that the database takes.
    enum class Space {
        kTakes,      ///< may let it grow
        kTakesOnce,  ///< the same, and the work must not be done a second time
        kFrees,      ///< must be possible on a full disk
    };

    // Throw Failure and what the work throws. The work may be done again after an error of the database,
    // unless it is kTakesOnce.
    virtual void inWriteTransaction(Space space, const Work& work) = 0;
    virtual void inReadTransaction(const Work& work) = 0;
    virtual TimestampMs now() const = 0;
    /// Of what this process imports, until it is complete: hidden, as sql.h says.
    virtual std::string importName() const;
    /// zstd level of stored points, 1 to 19.
    virtual int pointCompressionLevel() const noexcept = 0;

    // Where several processes write at the same time, a transaction locks first what it decides by, in this
    // order: the names of collections, then collections in ascending order of id, with all that is in them.
    // Where one writes after another there is nothing to do.
    virtual void lockNames(Connection& connection) { static_cast<void>(connection); }
    /// One that does not exist is passed over.
    virtual void lockCollection(Connection& connection, std::int64_t collectionId) {
        static_cast<void>(connection), static_cast<void>(collectionId);
    }
    virtual void lockCollectionsOf(Connection& connection, const std::vector<std::int64_t>& shapeIds) {
        static_cast<void>(connection), static_cast<void>(shapeIds);
    }

    // What other servers of the same database must hear of, in the transaction of the change: one shape, or
    // the collection as a whole. A server that has the database alone knows.
    virtual void logChange(Connection& connection, std::int64_t collectionId, std::int64_t shapeId) {
        static_cast<void>(connection), static_cast<void>(collectionId), static_cast<void>(shapeId);
    }
    virtual void logAll(Connection& connection, std::int64_t collectionId) {
        static_cast<void>(connection), static_cast<void>(collectionId);
    }

    /// Before what lets the database grow. Errors: kStorageFull.
    virtual Result<void> requireSpace() noexcept { return {}; }
    /// What can still be listed after `damage`, as Store::listCollections and listAliases. Throws Failure.
    virtual std::vector<Collection> salvageCollections(Connection& connection, const Failure& damage);
    virtual std::vector<Alias> salvageAliases(Connection& connection, const Failure& damage);

    /// Runs `work(connection)` in a write transaction and commits it, unless it throws.
    template <typename Body>
    auto write(const char* operation, Body&& work, Space space = Space::kTakes) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        return run(operation, work, [&](const Work& once) { inWriteTransaction(space, once); });
    }
    /// As `write`, for what frees space.
    template <typename Body>
    auto remove(const char* operation, Body&& work) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        return write(operation, work, Space::kFrees);
    }
    /// Runs `work(connection)` in a read transaction: all as of one moment.
    template <typename Body>
    auto read(const char* operation, Body&& work) noexcept
        -> Result<std::invoke_result_t<Body, Connection&>> {
        return run(operation, work, [&](const Work& once) { inReadTransaction(once); });
    }

    /// What importCollection does with the file that `open` makes a sound copy of; `path` names it in
    /// messages.
    Result<Collection> importFrom(const std::function<std::unique_ptr<Connection>()>& open,
                                  const std::string& path, const ImportRequest& request,
                                  const RunContext& context);
    /// Removes what an import has stored, some shapes at a time, if it was not completed.
    Result<void> dropImport() noexcept;
    /// The same for collections that were deleted.
    Result<void> dropDeleted() noexcept;

  private:
    template <typename Body, typename Run>
    static auto run(const char* operation, Body& work, Run inTransaction) noexcept
        -> Result<std::invoke_result_t<Body&, Connection&>> {
        using Value = std::invoke_result_t<Body&, Connection&>;
        return guarded(operation, [&]() -> Value {
            if constexpr (std::is_void_v<Value>) {
                inTransaction(std::ref(work));
            } else {
                std::optional<Value> value;
                auto keeping = [&](Connection& connection) { value.emplace(work(connection)); };
                inTransaction(std::ref(keeping));
                return std::move(*value);
            }
        });
    }

    PutResult insertShape(Connection& connection, const PutRequest& request, const PointEncoding& encoding);
    Shape replaceMetadata(Connection& connection, const Shape& existing, const Metadata& metadata);
    PutResult retryShape(Connection& connection, const PutRequest& request, const Shape& existing);
    PutResult replacePoints(Connection& connection, const PutRequest& request, const PointEncoding& encoding,
                            const Shape& existing);
    void queueJob(Connection& connection, const PutRequest& request, std::int64_t shapeId,
                  std::int64_t pointsVersion);
    std::optional<Shape> markFailed(Connection& connection, std::int64_t shapeId, const Error& why);
    /// Makes a failed shape pending and queues its job.
    void queueAgain(Connection& connection, std::int64_t collectionId, std::int64_t shapeId,
                    std::int64_t pointsVersion, std::uint64_t bytes);
    bool jobIsCurrent(Connection& connection, const Job& job, std::int64_t generation);

    /// The first part of an import: the collection, with no shapes and a name that nobody else uses.
    Collection beginImport(const Collection& wanted);
    /// The last part of an import: its name and its jobs.
    Collection finishImport(const Collection& imported);
    void importShapes(Connection& file, const Collection& from, const Collection& to,
                      const ImportRequest& request, const RunContext& context);
    /// Removes the collections that `statement` finds, with `name` if it takes one, which are hidden.
    Result<void> dropHidden(const char* operation, const char* statement,
                            const std::optional<std::string>& name) noexcept;

    std::mutex importMutex_;     ///< one import at a time
    std::mutex largeScanMutex_;  ///< one compressed copy of a large scan at a time, to bound memory
};

}  // namespace shapedb::store
