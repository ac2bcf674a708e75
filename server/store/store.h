// SPDX-License-Identifier: GPL-3.0-or-later
// What the server keeps on disk, as an interface without SQL. Nothing outside server/store/ knows
// which database is behind it.
//
// Acknowledged means durable: a scan and its job are committed in one transaction before the reply
// leaves.
//
// Thread-safe. Writes run one after another; reads run beside them and see the state at their
// start. Returned objects are copies.
//
// Errors of every function, not repeated below: kStorage (the database cannot be read or written),
// kStorageFull (nothing of the failed call is stored), kDataLoss (stored bytes are damaged),
// kOutOfMemory.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/metadata.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "server/store/change_log.h"
#include "server/store/import_request.h"
#include "server/store/metadata_change.h"
#include "server/store/quarantine.h"
#include "server/store/verified_scan.h"

namespace shapedb::store {

/// Milliseconds since 1970-01-01 UTC.
using TimestampMs = std::int64_t;

struct Collection {
    std::int64_t id = 0;  ///< never reused
    std::string name;     ///< unique
    std::string description;
    /// Segmentation and signature parameters as text (parameters_codec.h); opaque to the store.
    std::string parameters;
    /// Of the signatures that serve queries; a finished rebuild raises it by one.
    std::int64_t generation = 1;
    TimestampMs createdAt = 0;
    /// Set (by listCollections alone): its row cannot be read. Only the id is known, and the name unless that
    /// is empty.
    std::optional<Error> damage{};
};

/// Another name of a collection.
struct Alias {
    std::string name;  ///< unique, also among the names of collections
    std::int64_t collectionId = 0;
};

/// The numbers are persisted (column shape.state): never renumber.
enum class ShapeState : int {
    kPending = 0,  ///< its job is queued or running; an older signature may still serve
    kReady = 1,    ///< the current version has a signature
    kFailed = 2,   ///< the current version cannot be segmented; `failure` says why
};

struct Shape {
    std::int64_t id = 0;  ///< never reused; breaks ties in rankings
    std::int64_t collectionId = 0;
    std::string key;                 ///< the client's own id, unique in its collection
    std::int64_t version = 1;        ///< 1 when inserted, plus 1 with every change of points or metadata
    std::int64_t pointsVersion = 1;  ///< the version that last changed the points
    ShapeState state = ShapeState::kPending;
    std::uint64_t pointCount = 0;
    Checksum checksum{};
    Point3 origin;  ///< what the points are relative to: VerifiedScan::origin
    Metadata metadata;
    TimestampMs createdAt = 0;
    TimestampMs updatedAt = 0;     ///< last change of points, metadata, state or failure
    std::optional<Error> failure;  ///< set exactly when state is kFailed
};

/// The points of a shape as they were uploaded.
struct StoredPoints {
    std::vector<float> xyz;  ///< packed x y z, relative to `origin`
    Point3 origin;
};

enum class PutMode {
    kUpsert,      ///< insert or replace
    kInsertOnly,  ///< kAlreadyExists when the key is taken by other bytes or other metadata
    kUpdateOnly,  ///< kNotFound when the key is free
    kSamePoints,  ///< kAlreadyExists when the key is taken by other points
};

struct PutRequest {
    explicit PutRequest(VerifiedScan verified) : scan(std::move(verified)) {}

    VerifiedScan scan;
    std::int64_t collectionId = 0;
    std::string key;
    PutMode mode = PutMode::kUpsert;
    /// When set, the shape must have this version now; 0: the key must be free. A repeated request whose
    /// reply was lost is recognised: the shape is one version further and as requested.
    std::optional<std::int64_t> expectedVersion;
    MetadataChange metadata;  ///< of a shape that has the key; a new one gets those of `set`
    /// Asked about the metadata that the shape would have; an error refuses the put. Called in the
    /// transaction; must not call the store. Null accepts all.
    std::function<Result<void>(const Metadata&)> checkMetadata{};
    /// Bounds of the job queue (queued and running) with this scan in it, checked in the same
    /// transaction; 0: no bound. Ignored when no job is queued. A scan larger than maxQueuedBytes
    /// never fits: the caller keeps its point limit below that.
    std::uint64_t maxQueuedJobs = 0;
    std::uint64_t maxQueuedBytes = 0;
};

enum class PutOutcome {
    kCreated,          ///< new key, job queued
    kReplaced,         ///< other points, job queued
    kMetadataChanged,  ///< same points, other metadata: no job
    kUnchanged,        ///< same points and metadata, a repeated request: nothing written
    kRetried,          ///< same points of a shape that had failed, job queued
};

struct PutResult {
    PutOutcome outcome = PutOutcome::kCreated;
    Shape shape;  ///< as stored after the call
};

struct ShapeFilter {
    std::optional<ShapeState> state;
    /// Called for each row inside the read; null accepts all. Must not call the store.
    std::function<bool(const Shape&)> accept;
    /// Checked before each row, so that a read whose caller has gone stops.
    RunContext context{};
    std::string keyPrefix{};  ///< bytes that the key begins with
};

/// Equal times of change are in order of id; keys are compared byte by byte.
enum class ShapeOrder { kId, kKey, kUpdated };

/// The order of a listing, and where it continues.
struct ShapeListing {
    ShapeOrder order = ShapeOrder::kId;
    bool descending = false;
    /// Where the last shape of the page before stood when it was listed; it need not be there any more.
    struct Place {
        std::int64_t id = 0;
        TimestampMs updatedAt = 0;  ///< kUpdated only
        std::string key{};          ///< kKey only
    };
    std::optional<Place> after{};  ///< empty: from the start
};

/// One scan to segment. Claiming raises `attempts` durably.
struct Job {
    std::int64_t id = 0;
    std::int64_t shapeId = 0;
    std::int64_t collectionId = 0;
    std::int64_t pointsVersion = 0;  ///< of the shape, when the job was queued
    std::int64_t generation = 0;     ///< of the collection, when the job was claimed
    int attempts = 0;                ///< including this one, not counting `stops`
    int stops = 0;                   ///< as Deaths::stops (quarantine.h)
    std::uint64_t pointBytes = 0;    ///< uncompressed
};

struct QueueDepth {
    std::uint64_t jobs = 0;   ///< queued and running
    std::uint64_t bytes = 0;  ///< of their points, uncompressed
};

struct SignatureRow {
    std::int64_t shapeId = 0;
    std::int64_t pointsVersion = 0;
    std::int64_t generation = 1;
    std::string bytes;  ///< core/signature/signature_codec.h
    /// When written: the surface points (core/fit/surface_points_codec.h), stored beside the signature; empty
    /// leaves those of the shape as they are. Never read: see getSurface.
    std::string surface{};
    std::string views{};  ///< core/views/views_codec.h; empty: none
};

/// What verifying a shape needs.
struct SurfaceRow {
    std::int64_t pointsVersion = 0;
    std::string bytes;  ///< core/fit/surface_points_codec.h
};

/// What a search shows of a shape that it found.
struct StoredHit {
    Shape shape;
    Result<SignatureRow> signature;  ///< as getSignature, or kNotReady if it was not asked for
};

/// What the index needs of one shape.
struct IndexRow {
    std::int64_t shapeId = 0;
    std::string key;
    Metadata metadata;
    SignatureRow signature;
};

/// The numbers are persisted (column rebuild.state): never renumber.
enum class RebuildState : int { kRunning = 0, kDone = 1, kCancelled = 2, kFailed = 3 };

struct Rebuild {
    std::int64_t id = 0;
    std::int64_t collectionId = 0;
    std::int64_t targetGeneration = 0;
    std::string parameters;  ///< the collection's parameters once this rebuild is done
    RebuildState state = RebuildState::kRunning;
    std::uint64_t done = 0;    ///< shapes with a result of the target generation
    std::uint64_t failed = 0;  ///< of these, the ones that could not be segmented
    std::uint64_t total = 0;   ///< shapes the collection holds now
    TimestampMs startedAt = 0;
    TimestampMs finishedAt = 0;  ///< 0 while running
};

struct StoreStats {
    std::uint64_t collections = 0;
    std::uint64_t shapesPending = 0;
    std::uint64_t shapesReady = 0;
    std::uint64_t shapesFailed = 0;
    std::uint64_t signatures = 0;
    std::uint64_t pointBytes = 0;        ///< uncompressed
    std::uint64_t storedPointBytes = 0;  ///< as compressed
    std::uint64_t databaseBytes = 0;
    std::uint64_t walBytes = 0;
    /// Acknowledged changes that the database did not have when it was opened, now or earlier; 0 after
    /// `acknowledge` and after a restore.
    std::uint64_t missingCommits = 0;
    std::uint64_t notices = 0;  ///< what waits for `acknowledge`
    int schemaVersion = 0;
};

/// Deletions with an expected version that a store remembers, of all collections.
constexpr std::int64_t kDeletionsRemembered = 1'000;

class Store {
  public:
    virtual ~Store() = default;

    // Collections ------------------------------------------------------------------

    /// Errors: kAlreadyExists (a collection or an alias has the name).
    [[nodiscard]] virtual Result<Collection> createCollection(const std::string& name,
                                                              const std::string& description,
                                                              const std::string& parameters) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<Collection> getCollection(const std::string& name) = 0;
    /// By name. A damaged page takes out the collections on it (Collection::damage), not the others.
    [[nodiscard]] virtual Result<std::vector<Collection>> listCollections() = 0;
    /// Deletes the collection with its shapes, jobs and aliases. At one moment nobody can find it or its
    /// aliases any more, whatever happens from then on: `gone` is called, unless it is null, which must not
    /// call the store. Then its rows are removed, some at a time. An error after that moment says that rows
    /// are left: the next deletion of a collection removes them, or the next start. Errors: kNotFound.
    [[nodiscard]] virtual Result<void> deleteCollection(std::int64_t collectionId,
                                                        const std::function<void()>& gone) = 0;
    [[nodiscard]] Result<void> deleteCollection(std::int64_t collectionId) {
        return deleteCollection(collectionId, nullptr);
    }
    /// Errors: kNotFound, kAlreadyExists (as above; its own name is no error).
    [[nodiscard]] virtual Result<Collection> renameCollection(std::int64_t collectionId,
                                                              const std::string& name) = 0;
    /// A new alias, or one that named another collection before. Errors: kNotFound, kAlreadyExists (a
    /// collection has the name).
    [[nodiscard]] virtual Result<void> setAlias(const std::string& name, std::int64_t collectionId) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<void> deleteAlias(const std::string& name) = 0;
    /// By name.
    [[nodiscard]] virtual Result<std::vector<Alias>> listAliases() = 0;

    // Shapes -----------------------------------------------------------------------

    /// Stores a scan and queues its job in one transaction; durable when it returns.
    ///
    /// The same points (checksum and origin), and metadata that do not change: kUnchanged, also in
    /// insert-only mode. A failed shape is tried again: kRetried. New metadata alone raise the version and
    /// leave state, job and signature alone. New points make the shape pending and replace its job; the old
    /// signature serves until finishJob replaces it or failJob removes it.
    ///
    /// Errors (nothing is stored): kNotFound (collection, or the key in update-only mode),
    /// kAlreadyExists, kVersionConflict (names both versions), kQueueFull, those of request.checkMetadata.
    [[nodiscard]] virtual Result<PutResult> putShape(const PutRequest& request) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<Shape> getShape(std::int64_t collectionId, const std::string& key) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<Shape> getShapeById(std::int64_t shapeId) = 0;
    /// One for each key, empty where no shape has it; all as of one moment.
    [[nodiscard]] virtual Result<std::vector<std::optional<Shape>>> getShapes(
        std::int64_t collectionId, const std::vector<std::string>& keys) = 0;
    /// At most `limit` shapes after `listing.after`. By id and by key stable under inserts and deletes; by
    /// time of change a shape that changes moves. Errors: kCancelled, kDeadlineExceeded (filter.context).
    [[nodiscard]] virtual Result<std::vector<Shape>> listShapes(std::int64_t collectionId,
                                                                const ShapeListing& listing,
                                                                std::size_t limit,
                                                                const ShapeFilter& filter) = 0;
    /// Shapes with id > afterId, in ascending order of id.
    [[nodiscard]] Result<std::vector<Shape>> listShapes(std::int64_t collectionId, std::int64_t afterId,
                                                        std::size_t limit, const ShapeFilter& filter) {
        return listShapes(collectionId, {ShapeOrder::kId, false, ShapeListing::Place{afterId}}, limit,
                          filter);
    }
    /// Errors: kCancelled, kDeadlineExceeded (filter.context).
    [[nodiscard]] virtual Result<std::uint64_t> countShapes(std::int64_t collectionId,
                                                            const ShapeFilter& filter) = 0;
    /// Pending shapes without a signature that serves. Reads one row.
    [[nodiscard]] virtual Result<std::uint64_t> countWaiting(std::int64_t collectionId) = 0;
    /// Removes the shape with its points, signatures and jobs; returns it as it was. A repeated request with
    /// an expected version is recognised, for the last kDeletionsRemembered of them: the key is free, and the
    /// shape that it had was deleted so. Errors: kNotFound, kVersionConflict.
    [[nodiscard]] virtual Result<Shape> deleteShape(std::int64_t collectionId, const std::string& key,
                                                    std::optional<std::int64_t> expectedVersion) = 0;
    /// In one transaction, removes each of these shapes that is still there and of which `still` says so, and
    /// returns them as they were. `still` must not call the store.
    [[nodiscard]] virtual Result<std::vector<Shape>> deleteShapes(
        const std::vector<std::int64_t>& shapeIds, const std::function<bool(const Shape&)>& still) = 0;
    /// In one transaction, gives each of these shapes that is still there the metadata that `change` returns,
    /// and returns those that had others, as they are now. Where `change` returns nothing the shape is left
    /// alone. Raises the version; state, job and signature stay. `change` must not call the store.
    [[nodiscard]] virtual Result<std::vector<Shape>> changeMetadata(
        const std::vector<std::int64_t>& shapeIds,
        const std::function<std::optional<Metadata>(const Shape&)>& change) = 0;
    /// Compared with the stored checksum. Errors: kNotFound, kDataLoss.
    [[nodiscard]] virtual Result<StoredPoints> loadPoints(std::int64_t shapeId) = 0;
    /// The signature that serves now. Errors: kNotFound (shape), kNotReady.
    [[nodiscard]] virtual Result<SignatureRow> getSignature(std::int64_t shapeId) = 0;
    /// One for each id, empty where the shape is gone; all as of one moment and in one read of the database.
    [[nodiscard]] virtual Result<std::vector<std::optional<StoredHit>>> getHits(
        const std::vector<std::int64_t>& shapeIds, bool withSignatures) = 0;
    /// The surface points of the shape; empty if none were stored yet. Errors: kNotFound (shape).
    [[nodiscard]] virtual Result<std::optional<SurfaceRow>> getSurface(std::int64_t shapeId) = 0;

    // Jobs -------------------------------------------------------------------------

    // A result counts only if it was made with the collection's current parameters. One of an older
    // generation (a rebuild has finished meanwhile) is dropped and its job is queued again as if it
    // had not been tried. finishJob looks at the generation of the signature, failJob at the job's.

    /// The oldest queued job of those that were stopped least often, now marked running; empty when there is
    /// none. A released job keeps its place.
    [[nodiscard]] virtual Result<std::optional<Job>> claimJob() = 0;
    /// Stores the signature, marks the shape ready and removes the job, in one transaction. Returns
    /// the shape as it is now; empty when the result was dropped because the shape was deleted, its
    /// points replaced, the database restored or the collection rebuilt meanwhile. During a rebuild
    /// the shape still needs a result of the target generation: rebuildBatch lists it from now on,
    /// also below an `afterId` already passed.
    /// Errors: kInvalidArgument (signature of another shape, of other points, or of a generation that
    /// does not exist yet).
    [[nodiscard]] virtual Result<std::optional<Shape>> finishJob(const Job& job,
                                                                 const SignatureRow& signature) = 0;
    /// Marks the shape failed and removes its signatures and the job. Empty as in finishJob.
    [[nodiscard]] virtual Result<std::optional<Shape>> failJob(const Job& job, const Error& why) = 0;
    /// Puts a claimed job back as if it had not been tried. No effect when the claim is no longer
    /// valid.
    [[nodiscard]] virtual Result<void> releaseJob(const Job& job) = 0;
    /// At start: queues the running jobs of a dead process again. Those in `crashes` count as tried, the
    /// others as stopped, and run after all other jobs. The shapes of those that isQuarantined (quarantine.h)
    /// are failed (as failJob, kInternal) and returned. Not while workers hold jobs.
    [[nodiscard]] virtual Result<std::vector<Shape>> recoverJobs(int maxAttempts,
                                                                 const std::vector<Crash>& crashes) = 0;
    /// Makes failed shapes pending again and queues their jobs, in one transaction, as far as there is room
    /// in the queue (bounds as in PutRequest); returns how many. Ids of shapes that are not failed or not
    /// there are passed over. Errors: kQueueFull (no room for the first).
    [[nodiscard]] virtual Result<std::uint64_t> retryShapes(const std::vector<std::int64_t>& shapeIds,
                                                            std::uint64_t maxQueuedJobs,
                                                            std::uint64_t maxQueuedBytes) = 0;
    [[nodiscard]] virtual Result<QueueDepth> queueDepth() = 0;

    // Index ------------------------------------------------------------------------

    /// Serving signatures with shape id > afterId, in ascending order of id, at most `limit`. A pending shape
    /// comes with the signature of its older points, if it has one. Errors: kNotFound (collection),
    /// kDataLoss (names the shape).
    [[nodiscard]] virtual Result<std::vector<IndexRow>> loadIndex(std::int64_t collectionId,
                                                                  std::int64_t afterId,
                                                                  std::size_t limit) = 0;

    // Changes by other servers -------------------------------------------------------

    /// Whether other servers may change the content. If not, the next two find nothing.
    [[nodiscard]] virtual bool isShared() const noexcept { return false; }
    [[nodiscard]] virtual Result<ChangeLogs> changeLogs() { return ChangeLogs{}; }
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<CollectionPosition> position(std::int64_t collectionId) {
        static_cast<void>(collectionId);
        return CollectionPosition{};
    }
    /// Changes of the collection with a number > `number`, in ascending order, at most `limit`. Old ones are
    /// forgotten: then the first is not `number` + 1.
    [[nodiscard]] virtual Result<std::vector<Change>> changesAfter(std::int64_t collectionId,
                                                                   std::int64_t number, std::size_t limit) {
        static_cast<void>(collectionId), static_cast<void>(number), static_cast<void>(limit);
        return std::vector<Change>{};
    }

    // Rebuild ----------------------------------------------------------------------
    //
    // Functions that take a rebuild's id, except getRebuild, also fail with kNotFound, and with
    // kRejected when it is not running.

    /// Starts a rebuild of the collection with these parameters into the next generation; the
    /// current one serves until `finishRebuild`. Errors: kNotFound, kAlreadyExists (one is running:
    /// names its id).
    [[nodiscard]] virtual Result<Rebuild> startRebuild(std::int64_t collectionId,
                                                       const std::string& parameters) = 0;
    /// The counts are current while it runs, and final afterwards. Errors: kNotFound.
    [[nodiscard]] virtual Result<Rebuild> getRebuild(std::int64_t rebuildId) = 0;
    /// All in state kRunning, including those a dead process left.
    [[nodiscard]] virtual Result<std::vector<Rebuild>> runningRebuilds() = 0;
    /// Shapes that still need a result of the target generation, except those with a job of their
    /// own. With id > afterId, in ascending order of id, at most `limit`. Start again from 0 when
    /// finishRebuild returns false.
    [[nodiscard]] virtual Result<std::vector<Shape>> rebuildBatch(std::int64_t rebuildId,
                                                                  std::int64_t afterId,
                                                                  std::size_t limit) = 0;
    /// One shape's result: a signature, or why there is none. The last one counts. Silently dropped
    /// when the shape was deleted or its points replaced meanwhile. Errors: kInvalidArgument
    /// (signature of another generation).
    [[nodiscard]] virtual Result<void> putRebuilt(std::int64_t rebuildId, const SignatureRow& signature) = 0;
    [[nodiscard]] virtual Result<void> putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId,
                                                         std::int64_t pointsVersion, const Error& why) = 0;
    /// If every shape without a job has a result: makes the target generation the serving one, sets
    /// shape states and the collection's parameters and deletes the old signatures in one
    /// transaction, and returns true. False when results are missing. A shape with a job stays
    /// pending and serves nothing until that job has run with the new parameters. A ready shape that could
    /// not be segmented again keeps its signature and stays ready, if the profile is the same.
    [[nodiscard]] virtual Result<bool> finishRebuild(std::int64_t rebuildId) = 0;
    /// Ends a running rebuild as kCancelled or kFailed and deletes its results.
    /// Errors: kInvalidArgument (another state).
    [[nodiscard]] virtual Result<void> abandonRebuild(std::int64_t rebuildId, RebuildState state) = 0;

    // Maintenance --------------------------------------------------------------------

    /// Copies the whole database, as it is now, to a new file while others read and write. The file
    /// appears under its name when it is complete. Of a database that is known to be damaged the tables are
    /// copied, and new indices made, if the tables can be read. Reports the stage "backup" in pages or
    /// tables. Errors: kAlreadyExists (the file), kFileNotWritable, kCancelled, kDeadlineExceeded.
    [[nodiscard]] virtual Result<void> backup(const std::string& path, const RunContext& context) = 0;
    /// About how many bytes a backup writes. Reads no row: it is asked when tables are damaged.
    [[nodiscard]] virtual Result<std::uint64_t> backupBytes() = 0;
    /// Replaces the whole content by that of a backup file, atomically. A private copy of the file is
    /// migrated if it is older, and must pass `check` first; the file itself is left alone. On any
    /// error the content stays as it was.
    ///
    /// Collections and shapes keep their ids and generations; jobs come back queued. Jobs and
    /// rebuilds get new ids and no id is ever given out twice, so that results still in flight for
    /// the old content are dropped. The caller reloads whatever it has cached. `replacing`, unless null, is
    /// called once the file has passed, before any read can see its content; an error that it returns ends
    /// the restore; it must not call the store. Reports "copy" (bytes), "integrity", "points", "restore"
    /// (pages). Errors: kFileNotReadable, kMalformedFile (says what is wrong), kSchemaTooNew, kCancelled,
    /// kDeadlineExceeded.
    [[nodiscard]] virtual Result<void> restore(const std::string& path, const RunContext& context,
                                               const std::function<Result<void>()>& replacing) = 0;
    /// About how many bytes exportCollection writes. Errors: kNotFound.
    [[nodiscard]] virtual Result<std::uint64_t> exportBytes(std::int64_t collectionId) = 0;
    /// Copies one collection, as it is now, to a new file while others read and write: its parameters,
    /// shapes, serving signatures and surface points, and a job for each pending shape; no aliases and
    /// rebuilds. The file is a database with this collection alone, passes `check`, and appears under its
    /// name when it is complete. Reports the stages "export" (shapes), "integrity", "points". Errors:
    /// kNotFound, kAlreadyExists (the file), kFileNotWritable, kCancelled, kDeadlineExceeded.
    [[nodiscard]] virtual Result<void> exportCollection(std::int64_t collectionId, const std::string& path,
                                                        const RunContext& context) = 0;
    /// Adds the one collection of such a file (or of a backup that holds no other) beside those that are
    /// there. Prepares and checks the file as `restore` does. The collection and its shapes get new ids,
    /// which are in the same order; generation, versions and times stay. Pending shapes are queued as if
    /// untried, however long the queue becomes. Nothing of it is seen before it is complete, no write waits
    /// for long, and an error leaves nothing. Reports as `restore`, with "import" (shapes) in place of
    /// "restore". Errors: those of `restore`, kMalformedFile also for more collections or none;
    /// kAlreadyExists (the name is taken), kRejected (another import is running), those of the functions in
    /// `request`.
    [[nodiscard]] virtual Result<Collection> importCollection(const std::string& path,
                                                              const ImportRequest& request,
                                                              const RunContext& context) = 0;
    /// Reads everything: database integrity, references, all checksums, the rules between tables.
    /// One line per problem; after two hundred, one that says there are more; empty when sound. Reports
    /// the stages "integrity" and "points" (in shapes). Errors: kCancelled, kDeadlineExceeded.
    [[nodiscard]] virtual Result<std::vector<std::string>> check(const RunContext& context) = 0;
    [[nodiscard]] virtual Result<StoreStats> stats() = 0;
    /// Moves the write-ahead log into the database file (at shutdown). Errors: kStorage also when a
    /// read outlasts the busy timeout.
    [[nodiscard]] virtual Result<void> checkpoint() = 0;
    /// What an operator must know of how the database was found when it was opened: acknowledged changes that
    /// are missing, what was mended. One line each; `check` lists them too. Empty after a restore. That
    /// changes are missing, or may be, is reported at every start until `acknowledge`.
    [[nodiscard]] virtual std::vector<std::string> findings() const = 0;
    /// How many of them wait for `acknowledge`. Reads no disk.
    [[nodiscard]] virtual std::size_t notices() const = 0;
    /// Stops reports of missing changes. Returns what was reported, one line for each.
    [[nodiscard]] virtual Result<std::vector<std::string>> acknowledge() = 0;
};

}  // namespace shapedb::store
