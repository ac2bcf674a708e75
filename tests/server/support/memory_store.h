// SPDX-License-Identifier: GPL-3.0-or-later
// The Store contract in maps: a plain second implementation for tests of the layers above. Not
// durable; backups and exports copy the content under the name of the "file".
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace shapedb::testing {

class MemoryStore : public store::Store {
  public:
    /// Called at the start of each function with its name; an error it returns becomes the function's.
    /// Set before use.
    std::function<std::optional<Error>(const std::string& function)> fault;

    Result<store::Collection> createCollection(const std::string& name, const std::string& description,
                                               const std::string& parameters) override;
    Result<store::Collection> getCollection(const std::string& name) override;
    Result<std::vector<store::Collection>> listCollections() override;
    using Store::deleteCollection;
    Result<void> deleteCollection(std::int64_t collectionId, const std::function<void()>& gone) override;
    Result<store::Collection> renameCollection(std::int64_t collectionId, const std::string& name) override;
    Result<void> setAlias(const std::string& name, std::int64_t collectionId) override;
    Result<void> deleteAlias(const std::string& name) override;
    Result<std::vector<store::Alias>> listAliases() override;

    Result<store::PutResult> putShape(const store::PutRequest& request) override;
    Result<store::Shape> getShape(std::int64_t collectionId, const std::string& key) override;
    Result<store::Shape> getShapeById(std::int64_t shapeId) override;
    Result<std::vector<std::optional<store::Shape>>> getShapes(std::int64_t collectionId,
                                                               const std::vector<std::string>& keys) override;
    using Store::listShapes;
    Result<std::vector<store::Shape>> listShapes(std::int64_t collectionId,
                                                 const store::ShapeListing& listing, std::size_t limit,
                                                 const store::ShapeFilter& filter) override;
    Result<std::uint64_t> countShapes(std::int64_t collectionId, const store::ShapeFilter& filter) override;
    Result<std::uint64_t> countWaiting(std::int64_t collectionId) override;
    Result<store::Shape> deleteShape(std::int64_t collectionId, const std::string& key,
                                     std::optional<std::int64_t> expectedVersion) override;
    Result<std::vector<store::Shape>> deleteShapes(
        const std::vector<std::int64_t>& shapeIds,
        const std::function<bool(const store::Shape&)>& still) override;
    Result<std::vector<store::Shape>> changeMetadata(
        const std::vector<std::int64_t>& shapeIds,
        const std::function<std::optional<Metadata>(const store::Shape&)>& change) override;
    Result<store::StoredPoints> loadPoints(std::int64_t shapeId) override;
    Result<store::SignatureRow> getSignature(std::int64_t shapeId) override;
    Result<std::vector<std::optional<store::StoredHit>>> getHits(const std::vector<std::int64_t>& shapeIds,
                                                                 bool withSignatures) override;
    Result<std::optional<store::SurfaceRow>> getSurface(std::int64_t shapeId) override;

    Result<std::optional<store::Job>> claimJob() override;
    Result<std::optional<store::Shape>> finishJob(const store::Job& job,
                                                  const store::SignatureRow& signature) override;
    Result<std::optional<store::Shape>> failJob(const store::Job& job, const Error& why) override;
    Result<void> releaseJob(const store::Job& job) override;
    Result<std::vector<store::Shape>> recoverJobs(int maxAttempts,
                                                  const std::vector<store::Crash>& crashes) override;
    Result<std::uint64_t> retryShapes(const std::vector<std::int64_t>& shapeIds, std::uint64_t maxQueuedJobs,
                                      std::uint64_t maxQueuedBytes) override;
    Result<store::QueueDepth> queueDepth() override;

    Result<std::vector<store::IndexRow>> loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                   std::size_t limit) override;

    Result<store::Rebuild> startRebuild(std::int64_t collectionId, const std::string& parameters) override;
    Result<store::Rebuild> getRebuild(std::int64_t rebuildId) override;
    Result<std::vector<store::Rebuild>> runningRebuilds() override;
    Result<std::vector<store::Shape>> rebuildBatch(std::int64_t rebuildId, std::int64_t afterId,
                                                   std::size_t limit) override;
    Result<void> putRebuilt(std::int64_t rebuildId, const store::SignatureRow& signature) override;
    Result<void> putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId, std::int64_t pointsVersion,
                                   const Error& why) override;
    Result<bool> finishRebuild(std::int64_t rebuildId) override;
    Result<void> abandonRebuild(std::int64_t rebuildId, store::RebuildState state) override;

    Result<void> backup(const std::string& path, const RunContext& context) override;
    Result<void> restore(const std::string& path, const RunContext& context,
                         const std::function<Result<void>()>& replacing) override;
    Result<std::uint64_t> backupBytes() override { return std::uint64_t{0}; }
    Result<std::uint64_t> exportBytes(std::int64_t collectionId) override;
    Result<void> exportCollection(std::int64_t collectionId, const std::string& path,
                                  const RunContext& context) override;
    Result<store::Collection> importCollection(const std::string& path, const store::ImportRequest& request,
                                               const RunContext& context) override;
    Result<std::vector<std::string>> check(const RunContext& context) override;
    Result<store::StoreStats> stats() override;
    Result<void> checkpoint() override;
    std::vector<std::string> findings() const override { return {}; }
    std::size_t notices() const override { return 0; }
    Result<std::vector<std::string>> acknowledge() override { return std::vector<std::string>(); }

  private:
    struct QueuedJob {
        store::Job job;
        bool running = false;
    };
    /// A rebuild's result for one shape: bytes, or why there are none.
    struct Rebuilt {
        std::int64_t pointsVersion = 0;
        std::string bytes;
        std::optional<Error> failure;
    };
    struct Content {
        std::map<std::int64_t, store::Collection> collections;
        std::map<std::string, std::int64_t> aliases;
        std::map<std::int64_t, store::Shape> shapes;
        std::map<std::int64_t, std::vector<float>> points;
        std::map<std::int64_t, store::SignatureRow> signatures;
        std::map<std::int64_t, store::SurfaceRow> surfaces;
        std::map<std::int64_t, QueuedJob> jobs;
        std::map<std::int64_t, store::Rebuild> rebuilds;
        std::map<std::int64_t, std::map<std::int64_t, Rebuilt>> rebuilt;
        std::vector<store::Shape> deleted;  ///< with an expected version
        std::int64_t nextId = 1;
    };

    template <typename Body>
    auto guarded(const char* function, Body&& body) -> decltype(body()) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (fault) {
            if (auto error = fault(function)) return fail(*error);
        }
        return body();
    }

    Result<std::vector<store::Shape>> list(std::int64_t collectionId, const store::ShapeListing& listing,
                                           std::size_t limit, const store::ShapeFilter& filter) const;
    static store::TimestampMs now();
    /// By a collection or an alias.
    bool isTaken(const std::string& name) const;
    store::Shape* find(std::int64_t collectionId, const std::string& key);
    void queueJob(const store::Shape& shape);
    void removeShape(std::int64_t shapeId);
    /// The shape if the job is still its current one; the job is dropped in any case.
    void removeJobs(std::int64_t shapeId);
    bool hasJob(std::int64_t shapeId) const;
    /// All jobs but those of this shape; 0: all.
    store::QueueDepth queueWithout(std::int64_t shapeId) const;
    /// The job's shape; null when a result no longer counts. One of an older generation puts the job back.
    Result<store::Shape*> current(const store::Job& job, std::int64_t generation);
    void markFailed(store::Shape& shape, const Error& why);
    void retry(store::Shape& shape);
    void putSurface(const store::SignatureRow& row);
    void release(const store::Job& job);

    Result<store::Rebuild*> running(std::int64_t rebuildId);
    void count(store::Rebuild& rebuild) const;
    std::vector<store::Shape> missing(const store::Rebuild& rebuild, std::int64_t afterId,
                                      std::size_t limit) const;
    void put(const store::Rebuild& rebuild, std::int64_t shapeId, Rebuilt result);
    void end(store::Rebuild& rebuild, store::RebuildState state);

    std::mutex mutex_;
    Content content_;
    std::map<std::string, Content> backups_;
    std::map<std::string, Content> exports_;
};

}  // namespace shapedb::testing
