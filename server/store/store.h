// What the server keeps on disk, as an interface without SQL.
//
// Everything the server has acknowledged is in here before the reply leaves: a scan and
// its job are one transaction. Nothing outside server/store/ knows which database it is.
//
// Thread-safety: every member function may be called from any thread. Writes are
// serialised inside (one writer); reads run beside them and see a consistent state as of
// their start. Returned objects are copies owned by the caller.
//
// Errors common to all functions, not repeated below: kStorage (the database cannot be
// read or written), kStorageFull (no room on the device: nothing of the failed call is
// stored), kDataLoss (stored bytes are damaged), kOutOfMemory.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/metadata.h"
#include "core/base/run_context.h"

namespace shapedb::store {

using shapedb::Metadata;

/// SHA-256 of the points as they travel: packed little-endian float32 x y z.
using Checksum = std::array<std::uint8_t, 32>;

/// Milliseconds since 1970-01-01 UTC.
using TimestampMs = std::int64_t;

struct Collection {
    std::int64_t id = 0;  ///< never reused
    std::string name;     ///< unique
    std::string description;
    /// Segmentation and signature parameters as text; the store does not look inside.
    std::string parameters;
    /// Signatures of one collection that serve queries all carry this number; a finished
    /// rebuild raises it by one.
    std::int64_t generation = 1;
    TimestampMs createdAt = 0;
};

/// The numbers are persisted (column shape.state): never renumber.
enum class ShapeState : int {
    kPending = 0,  ///< stored, its job is queued or running; an older signature may still serve
    kReady = 1,    ///< the current version has a signature
    kFailed = 2,   ///< the current version cannot be segmented; `failure` says why
};

struct Shape {
    std::int64_t id = 0;  ///< never reused; breaks ties in rankings
    std::int64_t collectionId = 0;
    std::string key;                 ///< the client's own id, unique in its collection
    std::int64_t version = 1;        ///< 1 at first insert, plus 1 on every change of points or metadata
    std::int64_t pointsVersion = 1;  ///< the version at which the points last changed
    ShapeState state = ShapeState::kPending;
    std::uint64_t pointCount = 0;
    Checksum checksum{};
    Metadata metadata;
    TimestampMs createdAt = 0;
    TimestampMs updatedAt = 0;     ///< when points, metadata, state or failure last changed
    std::optional<Error> failure;  ///< set exactly when state is kFailed
};

enum class PutMode {
    kUpsert,      ///< insert or replace
    kInsertOnly,  ///< kAlreadyExists when the key is taken by other bytes or other metadata
    kUpdateOnly,  ///< kNotFound when the key is free
};

struct PutRequest {
    std::int64_t collectionId = 0;
    std::string key;
    PutMode mode = PutMode::kUpsert;
    /// When set, the shape's version must be this now; 0 demands that the key is free. Holds
    /// for repeated requests too: who lost a reply reads the shape and compares.
    std::optional<std::int64_t> expectedVersion;
    Metadata metadata;
    const std::vector<float>* points = nullptr;  ///< packed x y z; not owned; size a multiple of 3
    Checksum checksum{};
    /// Bounds of the job queue (queued and running) after this scan has joined it, checked in
    /// the same transaction. 0: no bound. A scan larger than maxQueuedBytes never fits: the
    /// caller keeps its point limit below. Not looked at when no job is queued.
    std::uint64_t maxQueuedJobs = 0;
    std::uint64_t maxQueuedBytes = 0;
};

enum class PutOutcome {
    kCreated,          ///< new key, job queued
    kReplaced,         ///< other points, job queued
    kMetadataChanged,  ///< same points, other metadata: no job
    kUnchanged,        ///< same points, same metadata: a repeated request; nothing written
};

struct PutResult {
    PutOutcome outcome = PutOutcome::kCreated;
    Shape shape;  ///< as stored after the call
};

struct ShapeFilter {
    std::optional<ShapeState> state;
    /// Evaluated on each row inside the read; null accepts all. Must not call the store.
    std::function<bool(const Shape&)> accept;
};

/// One unit of segmentation work. Claiming raises `attempts` durably before it returns.
struct Job {
    std::int64_t id = 0;
    std::int64_t shapeId = 0;
    std::int64_t collectionId = 0;
    std::int64_t pointsVersion = 0;  ///< of the shape, when the job was queued
    std::int64_t generation = 0;     ///< of the collection, when the job was claimed
    int attempts = 0;                ///< including this one
    std::uint64_t pointBytes = 0;    ///< uncompressed
};

struct QueueDepth {
    std::uint64_t jobs = 0;   ///< queued and running
    std::uint64_t bytes = 0;  ///< of their points, uncompressed
};

/// What a finished segmentation leaves behind.
struct SignatureRow {
    std::int64_t shapeId = 0;
    std::int64_t pointsVersion = 0;
    std::int64_t generation = 1;
    std::string bytes;  ///< core/signature/signature_codec.h
};

/// What the cache needs of one shape.
struct IndexRow {
    std::int64_t shapeId = 0;
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
    int schemaVersion = 0;
};

class Store {
  public:
    virtual ~Store() = default;

    // Collections ------------------------------------------------------------------

    /// Errors: kAlreadyExists.
    [[nodiscard]] virtual Result<Collection> createCollection(const std::string& name,
                                                              const std::string& description,
                                                              const std::string& parameters) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<Collection> getCollection(const std::string& name) = 0;
    /// By name.
    [[nodiscard]] virtual Result<std::vector<Collection>> listCollections() = 0;
    /// Deletes the collection and all that is in it, queued jobs included. Errors: kNotFound.
    [[nodiscard]] virtual Result<void> deleteCollection(std::int64_t collectionId) = 0;

    // Shapes -----------------------------------------------------------------------

    /// Stores a scan and queues its job in one transaction; durable when it returns.
    ///
    /// The same checksum and metadata as stored is kUnchanged, in insert-only mode and for a
    /// failed shape too. Other metadata alone raise the version and leave state, job and
    /// signature. Other points make the shape pending and replace its job; the signature of
    /// the old points serves until finishJob replaces or failJob removes it.
    ///
    /// Errors: kNotFound (collection, or update-only), kAlreadyExists, kVersionConflict
    /// (the message names both versions), kQueueFull, kChecksumMismatch (the points do not
    /// have `checksum`), kInvalidArgument (points null or not triples); on any error nothing
    /// is stored.
    [[nodiscard]] virtual Result<PutResult> putShape(const PutRequest& request) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<Shape> getShape(std::int64_t collectionId, const std::string& key) = 0;
    /// Errors: kNotFound.
    [[nodiscard]] virtual Result<Shape> getShapeById(std::int64_t shapeId) = 0;
    /// Shapes with id > afterId by rising id, at most `limit`: stable under inserts and deletes.
    [[nodiscard]] virtual Result<std::vector<Shape>> listShapes(std::int64_t collectionId,
                                                                std::int64_t afterId, std::size_t limit,
                                                                const ShapeFilter& filter) = 0;
    [[nodiscard]] virtual Result<std::uint64_t> countShapes(std::int64_t collectionId,
                                                            const ShapeFilter& filter) = 0;
    /// Removes the shape, its points, signatures and jobs; returns what it was.
    /// Errors: kNotFound, kVersionConflict.
    [[nodiscard]] virtual Result<Shape> deleteShape(std::int64_t collectionId, const std::string& key,
                                                    std::optional<std::int64_t> expectedVersion) = 0;
    /// Packed x y z. Verified against the stored checksum. Errors: kNotFound, kDataLoss.
    [[nodiscard]] virtual Result<std::vector<float>> loadPoints(std::int64_t shapeId) = 0;
    /// The signature that serves now. Errors: kNotFound (no such shape), kNotReady.
    [[nodiscard]] virtual Result<SignatureRow> getSignature(std::int64_t shapeId) = 0;

    // Jobs -------------------------------------------------------------------------

    // A result counts only when it was made with the collection's present parameters: one of
    // an older generation (a rebuild finished meanwhile) is dropped and its job goes back to
    // the queue as if it had not been tried. finishJob takes the generation of the signature,
    // failJob that of the job.

    /// The oldest queued job, now marked running; empty when there is none. A job that was put
    /// back keeps its age.
    [[nodiscard]] virtual Result<std::optional<Job>> claimJob() = 0;
    /// Stores the signature, marks the shape ready and drops the job, in one transaction.
    /// Empty when the shape was deleted, its points replaced, the database restored or the
    /// collection rebuilt meanwhile: the result is dropped. Otherwise the shape as it is now.
    /// During a rebuild the shape still needs a result of the target generation: rebuildBatch
    /// lists it from then on, also below an `afterId` already passed.
    /// Errors: kInvalidArgument (the signature is of another shape, of other points, or of a
    /// generation that does not exist yet).
    [[nodiscard]] virtual Result<std::optional<Shape>> finishJob(const Job& job,
                                                                 const SignatureRow& signature) = 0;
    /// Marks the shape failed, removes its signatures and the job. Empty as in finishJob.
    [[nodiscard]] virtual Result<std::optional<Shape>> failJob(const Job& job, const Error& why) = 0;
    /// Puts a claimed job back as if it had not been tried (drain). Nothing happens when it is
    /// no longer this claim's.
    [[nodiscard]] virtual Result<void> releaseJob(const Job& job) = 0;
    /// At start: running jobs of a dead process are queued again; those that were tried
    /// `maxAttempts` times or more are quarantined (as failJob, code kInternal, with the
    /// reason). Returns the quarantined shapes. Not while workers hold jobs.
    [[nodiscard]] virtual Result<std::vector<Shape>> recoverJobs(int maxAttempts) = 0;
    [[nodiscard]] virtual Result<QueueDepth> queueDepth() = 0;

    // Index ------------------------------------------------------------------------

    /// Serving signatures (the collection's generation) with shape id > afterId, by rising
    /// id, at most `limit`. A pending shape comes with the signature of its older points, when
    /// it has one. Errors: kNotFound (collection), kDataLoss (the message names the shape).
    [[nodiscard]] virtual Result<std::vector<IndexRow>> loadIndex(std::int64_t collectionId,
                                                                  std::int64_t afterId,
                                                                  std::size_t limit) = 0;

    // Rebuild ----------------------------------------------------------------------
    //
    // Of the functions that take a rebuild's id, all but getRebuild also fail with kNotFound
    // and, when it is no longer running, kRejected.

    /// Starts re-segmenting the collection with these parameters into the next
    /// generation; the current one serves until `finishRebuild`. Errors: kNotFound,
    /// kAlreadyExists (one is running: the message gives its id).
    [[nodiscard]] virtual Result<Rebuild> startRebuild(std::int64_t collectionId,
                                                       const std::string& parameters) = 0;
    /// While it runs the counts are those of now, afterwards those of its end. Errors: kNotFound.
    [[nodiscard]] virtual Result<Rebuild> getRebuild(std::int64_t rebuildId) = 0;
    /// All in state kRunning, also those a dead process left.
    [[nodiscard]] virtual Result<std::vector<Rebuild>> runningRebuilds() = 0;
    /// Shapes without a result of the target generation for their current points; shapes
    /// whose own ingest job is still queued or running are left to it. By rising id, at most
    /// `limit`, id > afterId. Start again from 0 when finishRebuild says that shapes are missing.
    [[nodiscard]] virtual Result<std::vector<Shape>> rebuildBatch(std::int64_t rebuildId,
                                                                  std::int64_t afterId,
                                                                  std::size_t limit) = 0;
    /// One shape's result for the target generation: a signature, or why there is none.
    /// The last one counts. Dropped silently when the shape was deleted or its points replaced
    /// meanwhile. Errors: kInvalidArgument (signature of another generation).
    [[nodiscard]] virtual Result<void> putRebuilt(std::int64_t rebuildId, const SignatureRow& signature) = 0;
    [[nodiscard]] virtual Result<void> putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId,
                                                         std::int64_t pointsVersion, const Error& why) = 0;
    /// When every shape without a job has a result: makes the target generation the serving
    /// one, sets shape states and the collection's parameters, deletes the old signatures, all
    /// in one transaction, and returns true. False when shapes are missing. A shape with a job
    /// stays pending and serves nothing until its job, done with the new parameters, ends.
    [[nodiscard]] virtual Result<bool> finishRebuild(std::int64_t rebuildId) = 0;
    /// Ends a running rebuild (state kCancelled or kFailed) and deletes what it made.
    /// Errors: kInvalidArgument (another state).
    [[nodiscard]] virtual Result<void> abandonRebuild(std::int64_t rebuildId, RebuildState state) = 0;

    // Care ---------------------------------------------------------------------------

    /// Writes a consistent copy of the whole database to a new file while others go on
    /// reading and writing: the state as of its start. The file appears under its name when
    /// complete. Reports the stage "backup" in pages.
    /// Errors: kAlreadyExists (the file is there), kFileNotWritable, kCancelled,
    /// kDeadlineExceeded.
    [[nodiscard]] virtual Result<void> backup(const std::string& path, const RunContext& context) = 0;
    /// Replaces the whole content by that of a backup file, atomically: readers see the old
    /// or the new. The file is checked first in a private copy (format, schema version,
    /// everything `check` looks at; an older one is migrated there) and left as it is. On any
    /// error the content stays as it was.
    ///
    /// Ids and generations of collections and shapes come with the file; jobs and rebuilds get
    /// new ids, jobs come back queued, and ids given out before are not given out again:
    /// results in flight for the old content are dropped. Everything cached of the old
    /// content is to be loaded anew. Reports "copy" (bytes), "integrity", "points", "restore"
    /// (pages).
    /// Errors: kFileNotReadable, kMalformedFile (the message says what is wrong with it),
    /// kSchemaTooNew, kCancelled, kDeadlineExceeded.
    [[nodiscard]] virtual Result<void> restore(const std::string& path, const RunContext& context) = 0;
    /// Reads everything: database integrity, references, checksums of all points, signature
    /// presence for ready shapes. One line per problem, two hundred at most; empty when sound.
    /// Reports the stages "integrity" and "points" (in shapes). Errors: kCancelled,
    /// kDeadlineExceeded.
    [[nodiscard]] virtual Result<std::vector<std::string>> check(const RunContext& context) = 0;
    [[nodiscard]] virtual Result<StoreStats> stats() = 0;
    /// Moves the write-ahead log into the database file (at shutdown). Errors: kStorage also
    /// when a read did not end within the busy timeout.
    [[nodiscard]] virtual Result<void> checkpoint() = 0;
};

}  // namespace shapedb::store
