// SPDX-License-Identifier: GPL-3.0-or-later
// The shapes and collections of a server: store, index, workers and rebuilds, and every rule about
// what must happen together when one of them changes.
//
// Handlers of any transport validate and convert their messages, call the catalog and convert what
// it returns. It knows no transport and no database.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/metadata.h"
#include "core/base/run_context.h"
#include "server/catalog/change_follower.h"
#include "server/catalog/gates.h"
#include "server/catalog/parameter_overrides.h"
#include "server/catalog/recent_stats.h"
#include "server/index/collection_index.h"
#include "server/ingest/crash_isolation.h"
#include "server/ingest/progress_board.h"
#include "server/ingest/rebuild_driver.h"
#include "server/ingest/signature_pipeline.h"
#include "server/ingest/worker_pool.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::catalog {

class CallFrame;

struct CatalogOptions {
    std::uint64_t maxQueuedJobs = 0;   ///< as store::PutRequest
    std::uint64_t maxQueuedBytes = 0;  ///< as store::PutRequest
    std::uint64_t maxPoints = 0;       ///< of a scan that is imported; 0: any
    int segmentations = 1;             ///< for callers, at a time
    index::Signatures signatures = index::Signatures::kHere;
    bool segments = true;  ///< takes part in segmenting what was uploaded, and in rebuilds
    ingest::WorkerOptions workers;
    ingest::RebuildOptions rebuilds;
};

/// A shape and the collection it was looked up in.
struct FoundShape {
    index::SnapshotPtr collection;
    store::Shape shape;
    std::optional<double> quality{};  ///< of deleteShape alone: as Catalog::quality before
};

/// What a client says about a scan it adds.
struct ShapeHeader {
    std::string collection;  ///< empty: the default collection
    std::string key;
    store::PutMode mode = store::PutMode::kUpsert;
    std::optional<std::int64_t> expectedVersion;
    store::MetadataChange metadata;
};

struct AddedShape {
    store::PutOutcome outcome = store::PutOutcome::kCreated;
    store::Shape shape;
    std::string collection;
};

/// A stored scan, segmented again.
struct DescribedScan {
    store::StoredPoints points;  ///< in the order of the upload
    Description description;
};

struct ShapeCounts {
    std::uint64_t all = 0;
    std::uint64_t ready = 0;
    std::uint64_t failed = 0;
};

struct CatalogStats {
    store::StoreStats store;
    store::QueueDepth queue;  ///< waiting and running
    index::CollectionIndex::Totals index;
    std::uint64_t queued = 0;    ///< jobs that wait for a worker
    std::uint64_t running = 0;   ///< jobs
    std::uint64_t ingested = 0;  ///< jobs since start that ended in a signature
};

/// What of the server is in service.
struct Condition {
    /// Collections can be looked up: no restore is replacing them, none failed, and a shared database can be
    /// reached.
    bool content = true;
    bool segmentation = true;            ///< scans are taken in and segmented
    std::size_t damagedCollections = 0;  ///< as CollectionIndex::damaged
    bool searches = true;                ///< no part of the signatures is without a server
    bool complete = true;                ///< no change is missing that was not acknowledged as such
};

struct RebuildRequest {
    std::string collection;                    ///< empty: all
    bool cacheOnly = false;                    ///< read the stored signatures again, segment nothing
    bool detached = false;                     ///< tell only how each rebuild begins
    std::optional<ParameterOverrides> change;  ///< empty: the parameters stay
};

/// What `Catalog::rebuild` reports about one collection.
struct RebuildProgress {
    std::string collection;
    std::uint64_t done = 0;    ///< shapes, failed ones included
    std::uint64_t total = 0;   ///< shapes
    std::uint64_t failed = 0;  ///< shapes
    bool finished = false;     ///< the results are searched
    double seconds = 0.0;      ///< since it began, or until it ended
};
using OnRebuildProgress = std::function<Result<void>(const RebuildProgress&)>;

/// What is reported to a caller who follows a shape.
struct IngestEvent {
    store::ShapeState state = store::ShapeState::kPending;
    std::string stage;  ///< this and the next two only while pending, as ProgressBoard::Status
    std::uint64_t done = 0;
    std::uint64_t total = 0;
    std::optional<Error> failure;
    std::optional<double> quality;  ///< as `Catalog::servingQuality`, once ready
};
[[nodiscard]] bool operator==(const IngestEvent& a, const IngestEvent& b);

/// Called again and again while a caller waits; an error ends the waiting and is returned.
using Checkpoint = std::function<Result<void>()>;

/// Asked once a backup has passed all checks, before it replaces anything; an error ends the restore.
using MayReplace = std::function<Result<void>()>;

/// Thread-safe between `start` and `stop`, which belong to one thread. Errors of the store (store.h)
/// are possible everywhere and not repeated below. The same goes for kUnavailable: every call that looks up a
/// collection returns it while a restore replaces the content, and after one whose content could not be
/// loaded.
class Catalog {
  public:
    Catalog(std::unique_ptr<store::Store> store, ingest::SignaturePipeline pipeline, telemetry::LoggerPtr log,
            CatalogOptions options);
    /// As `stop`, without the checkpoint.
    ~Catalog();

    /// Creates the default collection if it is missing, loads the index and starts the workers and
    /// the rebuilds that a dead process left. Call once.
    [[nodiscard]] Result<void> start();
    /// Stops rebuilds and workers (their jobs return to the queue) and checkpoints the store.
    [[nodiscard]] Result<void> stop();

    // Collections ------------------------------------------------------------------

    /// By its name or an alias; the default collection for an empty name. Errors: kNotFound.
    [[nodiscard]] Result<index::SnapshotPtr> collection(const std::string& name) const;
    /// The name of the collection that `name` stands for now: itself, unless it is an alias or empty. Also of
    /// collections that are not there.
    [[nodiscard]] std::string nameOf(const std::string& name) const;
    /// By name.
    [[nodiscard]] Result<std::vector<index::SnapshotPtr>> collections() const;
    [[nodiscard]] Result<ShapeCounts> countShapes(const index::Snapshot& collection);
    /// Errors: kInvalidArgument (name, description), kAlreadyExists.
    [[nodiscard]] Result<index::SnapshotPtr> createCollection(const std::string& name,
                                                              const std::string& description,
                                                              const ShapeParameters& parameters);
    /// Cancels its rebuild and stops its workers. There is no default name and no alias is followed, so that
    /// only the collection that is meant can be deleted. Errors: kInvalidArgument (name), kNotFound;
    /// kRejected: it has shapes and `force` is not set.
    [[nodiscard]] Result<void> deleteCollection(const std::string& name, bool force);
    /// Follows no alias. Errors: kInvalidArgument (a name), kNotFound, kAlreadyExists; kRejected: it is the
    /// default collection, which requests without a name need.
    [[nodiscard]] Result<index::SnapshotPtr> renameCollection(const std::string& name,
                                                              const std::string& newName);
    /// A new alias, or one that named another collection before. Errors: kInvalidArgument (a name),
    /// kNotFound (the collection), kAlreadyExists (a collection has this name).
    [[nodiscard]] Result<index::SnapshotPtr> setAlias(const std::string& alias,
                                                      const std::string& collection);
    /// Errors: kInvalidArgument (name), kNotFound.
    [[nodiscard]] Result<void> deleteAlias(const std::string& alias);
    /// In ascending order.
    [[nodiscard]] std::vector<std::string> aliasesOf(const index::Snapshot& collection) const {
        return index_.aliasesOf(collection.collection.id);
    }
    /// About how many bytes an export writes. Errors: kNotFound.
    [[nodiscard]] Result<std::uint64_t> exportBytes(const std::string& name);
    /// As store::Store. Errors also: kNotFound (the collection).
    [[nodiscard]] Result<void> exportCollection(const std::string& name, const std::string& path,
                                                const RunContext& context);
    /// Refuses what `importCollection` would refuse under this name, before the file is sent. Errors:
    /// kInvalidArgument (name), kAlreadyExists, kUnavailable.
    [[nodiscard]] Result<void> admitImport(const std::string& name) const;
    /// Adds the collection of an exported file under `name`, or under its own if that is empty; searches find
    /// it, and workers get its pending shapes, when this returns. `mayUse` is asked for the name before
    /// anything is stored, and once more before any of it is seen. Errors, which call it "the file":
    /// kInvalidArgument (name, description, metadata), kMalformedFile (also: parameters), those of `mayUse`
    /// and of store::Store::importCollection.
    using MayUse = std::function<Result<void>(const std::string& name)>;
    [[nodiscard]] Result<index::SnapshotPtr> importCollection(const std::string& path,
                                                              const std::string& name, const MayUse& mayUse,
                                                              const RunContext& context);
    /// Reads the stored signatures again; nothing is segmented. Errors: kNotFound.
    [[nodiscard]] Result<index::SnapshotPtr> reload(const std::string& name);

    // What other servers change ------------------------------------------------------

    /// The number of the last change of the shape's collection: who demands it knows all that was stored of
    /// the shape by now. 0 where this server has the database alone, which shows every change at once, and
    /// where it cannot be read.
    [[nodiscard]] std::int64_t changeOf(const store::Shape& shape);
    /// The collection as it is searched now, with this change of it at least. Errors: kNotFound; kUnavailable
    /// (the change is not known).
    [[nodiscard]] Result<index::SnapshotPtr> withChange(const index::SnapshotPtr& collection,
                                                        std::int64_t atLeast);
    /// The collection with the parameters and the generation that it has now, and the number of its last
    /// change. Errors: kNotFound.
    struct Current {
        index::SnapshotPtr collection;
        std::int64_t lastChange = 0;
    };
    [[nodiscard]] Result<Current> current(const index::SnapshotPtr& collection);
    [[nodiscard]] bool holdsSignatures() const { return index_.where() == index::Signatures::kHere; }
    /// What `stats` tells of the signatures in memory, where they are not in the index. Before calls are
    /// served.
    void setTotals(std::function<index::CollectionIndex::Totals()> totals) { totals_ = std::move(totals); }
    /// The ids of all collections.
    [[nodiscard]] std::vector<std::int64_t> collectionIds() const;
    /// Surface points that are kept of these shapes may be old.
    void forgetSurfaces(const std::vector<std::int64_t>& shapeIds) { index_.forgetSurfaces(shapeIds); }

    // Shapes -----------------------------------------------------------------------

    /// Errors: kInvalidArgument (key), kNotFound.
    [[nodiscard]] Result<FoundShape> findShape(const index::SnapshotPtr& collection, const std::string& key);
    /// Errors: kNotFound.
    [[nodiscard]] Result<store::Shape> shapeById(std::int64_t shapeId);
    /// As store::Store.
    [[nodiscard]] Result<std::vector<std::optional<store::Shape>>> getShapes(
        std::int64_t collectionId, const std::vector<std::string>& keys);
    [[nodiscard]] Result<std::vector<store::Shape>> listShapes(std::int64_t collectionId,
                                                               const store::ShapeListing& listing,
                                                               std::size_t limit,
                                                               const store::ShapeFilter& filter);
    [[nodiscard]] Result<std::uint64_t> countShapes(std::int64_t collectionId,
                                                    const store::ShapeFilter& filter);

    /// Refuses what `put` would refuse, before the points are sent. Errors: kInvalidArgument (key,
    /// metadata, expected version), kNotFound (collection), kUnavailable (a restore is running).
    [[nodiscard]] Result<void> admitUpload(const ShapeHeader& header) const;
    /// Stores a scan, queues it, stops workers that have older points and makes searches see new
    /// metadata. Errors: kNotFound (collection), those of store::Store::putShape.
    [[nodiscard]] Result<AddedShape> put(const ShapeHeader& header, store::VerifiedScan scan);
    /// After kQueueFull: when to try again.
    [[nodiscard]] std::chrono::milliseconds retryAfterQueueFull();
    /// Deletes a shape, stops its worker and removes it from searches. Returns it as it was. Errors:
    /// kInvalidArgument (key), kNotFound, kVersionConflict.
    [[nodiscard]] Result<FoundShape> deleteShape(const std::string& collection, const std::string& key,
                                                 std::optional<std::int64_t> expectedVersion);

    // Changes of many shapes, one transaction each; bulk_changes.h divides what a request asks for into them.
    // `epoch` is that of the moment when the ids were read. Errors: kUnavailable (a restore replaced the
    // content since then: the ids may mean other shapes).

    /// As store::Store::deleteShapes; the shapes leave the searches and their workers stop.
    [[nodiscard]] Result<std::vector<store::Shape>> deleteShapes(
        std::uint64_t epoch, const std::vector<std::int64_t>& shapeIds,
        const std::function<bool(const store::Shape&)>& still);
    /// As store::Store::changeMetadata; searches see the new metadata.
    [[nodiscard]] Result<std::vector<store::Shape>> changeMetadata(
        std::uint64_t epoch, const std::vector<std::int64_t>& shapeIds,
        const std::function<std::optional<Metadata>(const store::Shape&)>& change);
    /// As store::Store::retryShapes with the bounds of this server; wakes the workers. Errors: kQueueFull.
    [[nodiscard]] Result<std::uint64_t> retryShapes(std::uint64_t epoch,
                                                    const std::vector<std::int64_t>& shapeIds);

    /// Follows a shape until it is no longer pending, and if it is ready, until searches find it. Calls
    /// `onEvent` at once and after each change of what it tells, never twice with the same event. Errors:
    /// kNotFound (deleted meanwhile); those of `onEvent` and `checkpoint`.
    [[nodiscard]] Result<void> watchIngest(std::int64_t shapeId, const Checkpoint& checkpoint,
                                           const std::function<Result<void>(const IngestEvent&)>& onEvent);
    /// Waits until a shape that was just added is no longer pending, and if it is ready, until searches
    /// find it. Returns the final row. Errors: as `watchIngest`; unless the shape was deleted they say that
    /// the scan is stored.
    [[nodiscard]] Result<store::Shape> awaitIngest(const store::Shape& added, const Checkpoint& checkpoint);

    /// The signature of a shape that searches of its collection find. If a rebuild was put in place since the
    /// collection was looked up, `found.collection` becomes the collection after it, and so does the
    /// signature. Errors: kNotReady, saying whether it is pending or why it failed; kDataLoss.
    [[nodiscard]] Result<Signature> signature(FoundShape& found);
    /// As store::Store.
    [[nodiscard]] Result<std::vector<std::optional<store::StoredHit>>> getHits(
        const std::vector<std::int64_t>& shapeIds, bool withSignatures);
    /// What is stored, with what the index leaves out. Errors: that of `row`; kNotReady (of another
    /// generation than `searched`), kDataLoss.
    [[nodiscard]] static Result<Signature> decoded(const index::Snapshot& searched,
                                                   const Result<store::SignatureRow>& row);
    /// The points of a shape in the order of the upload, and the shape that they are of, which may
    /// have changed since it was looked up. Takes their bytes from `share`. Errors: kNotFound (deleted
    /// meanwhile), kQueueFull, kDataLoss.
    struct StoredScan {
        store::Shape shape;
        std::vector<float> points;  ///< packed, relative to shape.origin
    };
    [[nodiscard]] Result<StoredScan> storedScan(const FoundShape& found, Budget::Share& share);
    /// The surface points of a shape, null if it has none (yet). Errors: kDataLoss.
    [[nodiscard]] Result<std::shared_ptr<const SurfacePoints>> surface(std::int64_t shapeId) {
        return index_.surface(shapeId);
    }
    /// Shapes that wait for their first signature: those whose older points are searched do not count.
    [[nodiscard]] Result<std::uint64_t> unsearchedShapes(const index::Snapshot& collection) {
        return store_->countWaiting(collection.collection.id);
    }
    /// How well the interior of a shape was determined, in [0, 1]; empty when searches do not find the shape
    /// or its profile does not rate interiors.
    [[nodiscard]] std::optional<double> quality(const index::Snapshot& collection,
                                                std::int64_t shapeId) const {
        return qualities(collection, {shapeId}).front();
    }
    [[nodiscard]] std::vector<std::optional<double>> qualities(
        const index::Snapshot& collection, const std::vector<std::int64_t>& shapeIds) const;
    /// `quality` in the shape's collection as it is searched now.
    [[nodiscard]] std::optional<double> servingQuality(const store::Shape& shape) const;

    // Segmentation for callers -----------------------------------------------------

    [[nodiscard]] SegmentationSlots& segmentationSlots() { return slots_; }
    /// Segments `scan` once `slot` has been acquired. Errors: those of `describe` and of acquiring the slot.
    [[nodiscard]] Result<Description> describe(SegmentationSlots::Slot& slot, const store::VerifiedScan& scan,
                                               const ShapeParameters& parameters, const RunContext& context);
    /// The same for a stored scan, with the parameters of its collection; loads it under the slot.
    [[nodiscard]] Result<DescribedScan> describe(SegmentationSlots::Slot& slot, const FoundShape& found,
                                                 const RunContext& context);

    // Rebuilds ---------------------------------------------------------------------

    /// Reads signatures again, or rebuilds and follows one collection after the other, and tells the
    /// progress of each. Errors: those of the functions below; kQueueFull (too many calls wait).
    [[nodiscard]] Result<void> rebuild(const RebuildRequest& request, CallFrame& frame,
                                       const OnRebuildProgress& onProgress);
    /// The names of the collections that a request means. Errors: kInvalidArgument (a change of parameters
    /// with `cacheOnly`, or without a collection named), kNotFound.
    [[nodiscard]] Result<std::vector<std::string>> rebuildTargets(const RebuildRequest& request) const;
    /// Starts the rebuilds of all `names` before any is followed, so that they go on if the caller is lost.
    /// Each has its collection's parameters after `change`, or is the running one with the same
    /// parameters. Errors: kInvalidArgument (parameters), kNotFound; kRejected: one with
    /// other parameters is running. Rebuilds started before an error go on.
    [[nodiscard]] Result<std::vector<store::Rebuild>> beginRebuilds(
        const std::vector<std::string>& names, const std::optional<ParameterOverrides>& change);
    /// Errors: kNotFound (the collection, or none is running).
    [[nodiscard]] Result<void> cancelRebuild(const std::string& collection);
    /// Calls `onChange` at once and after each change until the rebuild is done; the rebuild goes on
    /// whatever happens here. Errors: kCancelled, kInternal (the rebuild was cancelled, has failed),
    /// kNotFound; those of `onChange` and `checkpoint`; kDeadlineExceeded.
    [[nodiscard]] Result<void> followRebuild(
        const std::string& collection, store::Rebuild rebuild, const RunContext& context,
        const Checkpoint& checkpoint, const std::function<Result<void>(const store::Rebuild&)>& onChange);

    // The whole database -----------------------------------------------------------

    /// As store::Store.
    [[nodiscard]] Result<std::uint64_t> backupBytes() { return store_->backupBytes(); }
    [[nodiscard]] Result<void> backup(const std::string& path, const RunContext& context);
    [[nodiscard]] Result<std::vector<std::string>> check(const RunContext& context);
    /// As store::Store; logs what it reports.
    [[nodiscard]] Result<void> acknowledge();
    /// Replaces everything by the backup `path` while workers and rebuilds pause, and loads the index.
    /// Errors, which call it "the file": kRejected (another restore is running), those of
    /// store::Store::restore and of `mayReplace`; those of CollectionIndex::loadAll, after which the content
    /// is replaced but cannot be looked up.
    [[nodiscard]] Result<void> restore(const std::string& path, const RunContext& context,
                                       const MayReplace& mayReplace = nullptr);
    /// Calls that wait for a restore to end before they change something.
    [[nodiscard]] int waitingWrites() const { return restores_.waitingWrites(); }
    /// Rises with each restore: ids are only valid within one epoch.
    [[nodiscard]] std::uint64_t epoch() const { return restores_.epoch(); }
    [[nodiscard]] Result<CatalogStats> stats();
    /// As `stats`; what would take long to count may be some time old (RecentStats).
    [[nodiscard]] Result<CatalogStats> recentStats();
    /// Reads no disk.
    [[nodiscard]] Condition condition() const;

  private:
    Result<index::SnapshotPtr> followed(const store::Collection& collection);
    /// Errors: kUnavailable.
    Result<void> requireContent() const;
    /// Before a scan is taken in. Errors: kDataLoss (its parameters could not be read; WorkerPool::trouble).
    Result<void> requireIngest(const index::Snapshot& collection) const;
    /// Calls `onChange` with the row of a shape and its progress, at once and after each change, until it
    /// is no longer pending. Returns the final row.
    Result<store::Shape> followIngest(
        std::int64_t shapeId, const Checkpoint& checkpoint,
        const std::function<Result<void>(const store::Shape&, const ingest::ProgressBoard::Status&)>&
            onChange);
    IngestEvent eventOf(const store::Shape& shape, const ingest::ProgressBoard::Status& status) const;
    Result<void> reloadAll(const std::vector<std::string>& names, const OnRebuildProgress& onProgress);
    Result<void> restoreExclusively(const std::string& path, const RunContext& context,
                                    const MayReplace& mayReplace);
    Result<void> replaceContent(const std::string& path, const RunContext& context,
                                const MayReplace& mayReplace, bool& replaced);
    /// After a change that the store has acknowledged, which must not be reported as refused.
    void refreshOrLog(const store::Shape& shape, const char* consequence);
    /// The same for shapes of one collection; there may be none.
    void refreshOrLog(const std::vector<store::Shape>& shapes, const char* consequence);
    /// By its own name. Errors: kNotFound (also: an alias).
    Result<index::SnapshotPtr> collectionNamed(const std::string& name) const;
    /// What the store has counted, and what the server does now.
    Result<CatalogStats> withProgress(const store::StoreStats& stored);
    /// Under the gate of restores. Errors: kUnavailable.
    Result<void> requireEpoch(std::uint64_t epoch) const;

    // In order of construction; destroyed in reverse.
    telemetry::LoggerPtr log_;
    CatalogOptions options_;
    std::unique_ptr<store::Store> store_;
    ingest::SignaturePipeline pipeline_;
    index::CollectionIndex index_;
    ingest::ProgressBoard board_;
    ingest::CrashIsolation isolation_;
    ingest::WorkerPool workers_;
    ingest::RebuildDriver rebuilds_;
    RestoreGate restores_;
    RecentStats recentStats_{[this] { return store_->stats(); }};
    std::mutex directory_;  ///< held while collections come, go, or change names or aliases
    std::function<index::CollectionIndex::Totals()> totals_;
    bool lost_ = false;  ///< the last content restored could not be loaded; only restores look at it
    SegmentationSlots slots_;
    ChangeFollower follower_;  ///< idle unless the store is shared
};

}  // namespace shapedb::catalog
