// SPDX-License-Identifier: Apache-2.0
// The C++ client of a ShapeDB server. docs/client-library.md walks through it.
//
//     auto client = shapedb::client::Client::connect({"127.0.0.1:7878"});
//     client->addShape({{"", "cup-1"}}, points);
//     auto found = client->searchByScan({}, scan);
//
// No gRPC or protobuf type appears here: a program needs only these headers and the library.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/api/types.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb::client {

/// Used for addresses without a port.
constexpr int kDefaultPort = 7878;

/// When an idempotent call is retried: if the server cannot be reached or its queue is full, never after any
/// other error. Before try n the client waits initialBackoff * multiplier^(n - 2), at most maxBackoff, varied
/// at random by `jitter`; or as long as the server asks for (`grpc-retry-pushback-ms`). The count starts
/// again when the reason changes.
struct RetryPolicy {
    int maxAttempts = 5;       ///< tries in all while the server cannot be reached; at least 1
    int maxQueueAttempts = 5;  ///< tries in all while its queue is full; at least 1
    std::chrono::milliseconds initialBackoff{100};
    double multiplier = 2.0;  ///< at least 1
    std::chrono::milliseconds maxBackoff{5000};
    double jitter = 0.2;  ///< [0, 1]
};

/// Transport security. The files are PEM and read once, by Client::connect.
struct TlsOptions {
    bool enabled = false;
    /// Who signs the server's certificate; empty: whom this machine trusts.
    std::string caFile;
    /// For servers that ask clients for a certificate: both or neither.
    std::string certificateFile;
    std::string keyFile;
    /// The name that the server's certificate must have; empty: the host of the address.
    std::string serverName;
};

struct ClientOptions {
    /// HOST, HOST:PORT, [IPV6]:PORT, or any name that gRPC understands ("unix:/run/shapedb.sock").
    std::string address = "127.0.0.1:7878";
    TlsOptions tls{};
    /// Sent with every call, but never unprotected beyond this machine. Empty: what `apiKeyFile` holds.
    std::string apiKey{};
    /// A file with the key in its first line; empty: no key.
    std::string apiKeyFile{};
    /// The most one call may take, retries included; 0: no limit. Calls that follow work on the server
    /// (watchIngest, addShape with wait, rebuild, backup, restore, export, import, check) or change many
    /// shapes are limited by their RunContext alone.
    std::chrono::milliseconds deadline{60000};
    RetryPolicy retry{};
};

/// The defaults with what the environment says: SHAPEDB_SERVER (address), SHAPEDB_API_KEY,
/// SHAPEDB_API_KEY_FILE, SHAPEDB_TLS ("1": enabled), SHAPEDB_TLS_CA (also enables it),
/// SHAPEDB_CLIENT_CERTIFICATE, SHAPEDB_CLIENT_KEY. Not while another thread changes the environment.
[[nodiscard]] ClientOptions optionsFromEnvironment();

/// A connection to one server, opened when first needed and reopened when lost.
///
/// Every call blocks until it is answered. A RunContext can cancel it (kCancelled, within about 20 ms) and
/// limit its time (kDeadlineExceeded), and receives the progress of uploads and downloads in bytes.
///
/// Errors of every call, not repeated below: the server's, with its name and message; kUnauthenticated and
/// kPermissionDenied (the API key); kRateLimited; kUnavailable (cannot be reached); kDeadlineExceeded;
/// kCancelled; kOutOfMemory; kInternal. Scans are checked before they are sent: kTooFewPoints (none),
/// kNonFiniteCoordinate, kCoordinateOutOfRange (beyond single precision, or rounded to it so far from the
/// origin that the shape is lost).
///
/// Thread-safety: all member functions may be called from any number of threads at once.
class Client {
  public:
    /// Does not touch the network. Errors: kInvalidArgument naming the option and its range, also if an API
    /// key would be sent unprotected; kFileNotReadable (key or certificates).
    [[nodiscard]] static Result<Client> connect(ClientOptions options);

    ~Client();
    Client(Client&&) noexcept;
    Client& operator=(Client&&) noexcept;

    /// The server's address, with the port.
    [[nodiscard]] const std::string& address() const;

    // ------------------------------------------------------------------------------------ shapes

    /// Uploads one scan with its count and checksum, in chunks of at most 1 MiB. On return the scan is
    /// durable. The same key with the same points and metadata is the same shape, so the call is retried
    /// unless expectedVersion is set. Without metadata a shape that has the key keeps what it has.
    ///
    /// Points travel in single precision. If the scan lies so far from the origin that rounding would hurt it
    /// (a coordinate beyond 16 diagonals of the bounding box, as in surveyed coordinates), they are sent
    /// relative to the middle of the box, which the server keeps as Shape::origin. All points, positions and
    /// motions that come back are in the coordinates of the scan. The same points elsewhere are other points:
    /// kReplaced.
    [[nodiscard]] Result<AddReply> addShape(const AddRequest& request, const PointCloud& points,
                                            const RunContext& context = {}) const;

    /// Errors: kNotFound.
    [[nodiscard]] Result<Shape> getShape(const ShapeRef& shape, const RunContext& context = {}) const;

    /// Up to 1,000 shapes of one collection, as of one moment. Errors: kNotFound (the collection),
    /// kInvalidArgument.
    [[nodiscard]] Result<FoundShapes> getShapes(const std::string& collection,
                                                const std::vector<std::string>& keys,
                                                const RunContext& context = {}) const;

    /// The stored points of a shape; nothing is segmented. Errors: kNotFound, kChecksumMismatch.
    [[nodiscard]] Result<StoredPoints> getPoints(const ShapeRef& shape, const RunContext& context = {}) const;

    /// Some points of each of up to 1,000 shapes, at most `mostPoints` of each (0: as many as there are, up
    /// to 1,500); no scan is read. In the order of the keys, without those that no shape has. Errors:
    /// kNotFound (the collection), kInvalidArgument.
    [[nodiscard]] Result<std::vector<Preview>> getPreviews(const std::string& collection,
                                                           const std::vector<std::string>& keys,
                                                           std::uint32_t mostPoints = 0,
                                                           const RunContext& context = {}) const;

    /// Gives the shape `as` of another server, or of another collection, the points, origin and metadata that
    /// `shape` has here, bit for bit; it is segmented there. Repeating it changes nothing. Errors: kNotFound,
    /// kChecksumMismatch, and those of addShape there.
    [[nodiscard]] Result<AddReply> copyShape(const ShapeRef& shape, const Client& to, const ShapeRef& as,
                                             const RunContext& context = {}) const;

    /// One page. Errors: kNotFound, kMalformedFilter, kMalformedCursor, kInvalidArgument.
    [[nodiscard]] Result<ListPage> listShapes(const ListRequest& request,
                                              const RunContext& context = {}) const;

    /// How many shapes listShapes would return in all; page size, cursor and order are ignored.
    [[nodiscard]] Result<std::uint64_t> countShapes(const ListRequest& request,
                                                    const RunContext& context = {}) const;

    /// How many shapes have which value under a metadata key. Errors: kNotFound, kMalformedFilter,
    /// kInvalidArgument (also: too many different values).
    [[nodiscard]] Result<ValueCounts> countByValue(const ValueCountRequest& request,
                                                   const RunContext& context = {}) const;

    /// Deletes the shape with its points and signature; returns what it was. Not retried.
    /// Errors: kNotFound; kVersionConflict if `expectedVersion` is set and is not the current one.
    [[nodiscard]] Result<Shape> deleteShape(const ShapeRef& shape,
                                            std::optional<std::int64_t> expectedVersion = {},
                                            const RunContext& context = {}) const;

    /// Deletes many shapes, some at a time; what was deleted before an error stays deleted. Not retried, and
    /// limited by the RunContext alone. Errors: kNotFound (the collection), kMalformedFilter,
    /// kInvalidArgument (keys).
    [[nodiscard]] Result<DeleteReply> deleteShapes(const ShapeSelection& selection,
                                                   const RunContext& context = {}) const;

    /// Changes metadata without sending points. Errors: kNotFound, kInvalidArgument, kVersionConflict.
    [[nodiscard]] Result<MetadataReply> updateMetadata(const ShapeRef& shape, const MetadataChange& change,
                                                       std::optional<std::int64_t> expectedVersion = {},
                                                       const RunContext& context = {}) const;

    /// The same of all shapes that pass a filter (empty: all of the collection), some at a time; what was
    /// changed before an error stays changed. Not retried, and limited by the RunContext alone.
    [[nodiscard]] Result<MetadataReply> updateMetadataWhere(const std::string& collection,
                                                            const std::string& filter,
                                                            const MetadataChange& change,
                                                            const RunContext& context = {}) const;

    /// Queues failed shapes again; of a filter those that pass and have failed. Limited by the RunContext
    /// alone. Errors: kNotFound (the collection), kMalformedFilter, kInvalidArgument (keys), kQueueFull.
    [[nodiscard]] Result<RetryReply> retryShapes(const ShapeSelection& selection,
                                                 const RunContext& context = {}) const;

    /// Calls `onEvent` with the current state and with each change until the shape is kReady or kFailed;
    /// returns the last event. Errors: kNotFound.
    [[nodiscard]] Result<IngestEvent> watchIngest(const ShapeRef& shape,
                                                  const std::function<void(const IngestEvent&)>& onEvent,
                                                  const RunContext& context = {}) const;

    /// Errors: kNotFound, kNotReady.
    [[nodiscard]] Result<Signature> getSignature(const ShapeRef& shape, const RunContext& context = {}) const;

    /// The stored points with their segments. Errors: kNotFound; those of a segmentation.
    [[nodiscard]] Result<SegmentedScan> getSegments(const ShapeRef& shape,
                                                    const RunContext& context = {}) const;

    /// Segments a scan on the server without storing it. Errors: those of a segmentation.
    [[nodiscard]] Result<SegmentedScan> segment(const PointCloud& points, const Parameters& parameters,
                                                bool summaryOnly, const RunContext& context = {}) const;

    // ------------------------------------------------------------------------------------ search

    /// Errors of all searches: kNotFound, kNotReady, kInvalidArgument (k, threshold), kMalformedFilter,
    /// kMalformedSignature.
    [[nodiscard]] Result<SearchReply> searchByKey(const SearchOptions& options, const std::string& key,
                                                  bool includeSelf = false,
                                                  const RunContext& context = {}) const;

    /// The query travels as in addShape.
    [[nodiscard]] Result<SearchReply> searchByScan(const SearchOptions& options, const PointCloud& points,
                                                   const RunContext& context = {}) const;

    [[nodiscard]] Result<SearchReply> searchBySignature(const SearchOptions& options,
                                                        const std::string& encodedSignature,
                                                        const RunContext& context = {}) const;

    /// Replies in the order of the queries. The first error ends the call and names its query.
    [[nodiscard]] Result<std::vector<SearchReply>> searchBatch(const SearchOptions& options,
                                                               const std::vector<BatchQuery>& queries,
                                                               const RunContext& context = {}) const;

    [[nodiscard]] Result<Comparison> compare(const ShapeRef& query, const ShapeRef& other,
                                             const CompareOptions& options = {},
                                             const RunContext& context = {}) const;

    /// Lays a stored shape, or another scan, on a scan; nothing is stored. Motions lead from the coordinates
    /// of the other to those of `query`. Errors: kNotFound;
    /// kNotReady (the shape has no surface points yet).
    [[nodiscard]] Result<Alignment> align(const PointCloud& query, const ShapeRef& other,
                                          const CompareOptions& options = {},
                                          const RunContext& context = {}) const;
    [[nodiscard]] Result<Alignment> align(const PointCloud& query, const PointCloud& other,
                                          const CompareOptions& options = {},
                                          const RunContext& context = {}) const;

    // ------------------------------------------------------------------------------- collections

    /// Not retried. Errors: kAlreadyExists, kInvalidArgument.
    [[nodiscard]] Result<Collection> createCollection(const std::string& name, const std::string& description,
                                                      const Parameters& parameters,
                                                      const RunContext& context = {}) const;

    /// Errors: kNotFound.
    [[nodiscard]] Result<Collection> getCollection(const std::string& name,
                                                   const RunContext& context = {}) const;

    /// By name.
    [[nodiscard]] Result<std::vector<Collection>> listCollections(const RunContext& context = {}) const;

    /// Deletes its shapes too. Not retried. Errors: kNotFound; kRejected if it has shapes and `force` is
    /// false.
    [[nodiscard]] Result<void> deleteCollection(const std::string& name, bool force,
                                                const RunContext& context = {}) const;

    /// Not retried. Errors: kNotFound, kAlreadyExists, kInvalidArgument; kRejected (the default collection).
    [[nodiscard]] Result<Collection> renameCollection(const std::string& name, const std::string& newName,
                                                      const RunContext& context = {}) const;

    /// Makes `alias` stand for a collection, or for another one than before, at one moment. Returns that
    /// collection. Errors: kNotFound, kAlreadyExists (a collection has this name), kInvalidArgument.
    [[nodiscard]] Result<Collection> setAlias(const std::string& alias, const std::string& collection,
                                              const RunContext& context = {}) const;

    /// Not retried. Errors: kNotFound.
    [[nodiscard]] Result<void> deleteAlias(const std::string& alias, const RunContext& context = {}) const;

    // ------------------------------------------------------------------------------------- admin

    /// Starts a rebuild, or joins one that is running, and follows it to its end. Returns the last progress
    /// of each collection. Cancelling or losing the call does not stop the rebuild; calling again follows it.
    /// Errors: kNotFound; kRejected if one with other parameters is running.
    [[nodiscard]] Result<std::vector<RebuildProgress>> rebuild(
        const RebuildRequest& request, const std::function<void(const RebuildProgress&)>& onProgress,
        const RunContext& context = {}) const;

    /// Not retried. Errors: kNotFound (none is running).
    [[nodiscard]] Result<void> cancelRebuild(const std::string& collection,
                                             const RunContext& context = {}) const;

    /// Writes a consistent copy of the database to `path`, under another name first and renamed when it is
    /// complete and its checksum right. Errors: kFileNotWritable, kChecksumMismatch, kCountMismatch.
    [[nodiscard]] Result<BackupReport> backupToFile(const std::string& path,
                                                    const RunContext& context = {}) const;

    /// Writes to `path`, as backupToFile, only what has changed since an earlier backup: `since` is its file,
    /// or that of the last increment, which knows the backup that it leads to; nothing else is read here.
    /// Errors: those of backupToFile; kAlreadyExists (the file `path`), kFileNotReadable, kMalformedFile
    /// (`since` is neither of both, or damaged), kRejected (the server is too old).
    [[nodiscard]] Result<IncrementReport> incrementToFile(const std::string& path, const std::string& since,
                                                          const RunContext& context = {}) const;

    /// Replaces everything on the server with the backup at `path`. Not retried.
    /// Errors: kFileNotReadable.
    [[nodiscard]] Result<RestoreReport> restoreFromFile(const std::string& path,
                                                        const RunContext& context = {}) const;

    /// The same with the backup that a chain leads to, as mergeBackups. Needs no room on the disk here.
    /// Errors also those of mergeBackups.
    [[nodiscard]] Result<RestoreReport> restoreFromFiles(const std::vector<std::string>& files,
                                                         const RunContext& context = {}) const;

    /// Replaces everything on another server with what is here, as a backup and its restore would, without a
    /// file between them: reports the stage "copy" in bytes. Not retried. Errors: those of both.
    [[nodiscard]] Result<RestoreReport> copyEverything(const Client& to,
                                                       const RunContext& context = {}) const;

    /// Writes a consistent copy of one collection to `path`, as backupToFile. Aliases stay behind. Errors:
    /// kNotFound, and those of backupToFile.
    [[nodiscard]] Result<BackupReport> exportCollection(const std::string& collection,
                                                        const std::string& path,
                                                        const RunContext& context = {}) const;

    /// Adds the collection at `path`, which exportCollection wrote, under the name `collection`, or under its
    /// own if that is empty; nothing is segmented again. Not retried. Errors: kFileNotReadable,
    /// kMalformedFile, kSchemaTooNew, kAlreadyExists, kInvalidArgument (the name), kPointLimitExceeded.
    [[nodiscard]] Result<ImportReport> importCollection(const std::string& path,
                                                        const std::string& collection = {},
                                                        const RunContext& context = {}) const;

    /// Reads the whole database. Returns the problems found, one line each; empty if it is sound.
    [[nodiscard]] Result<std::vector<std::string>> check(
        const std::function<void(const CheckProgress&)>& onProgress, const RunContext& context = {}) const;
    /// The same; acknowledged changes that it returns as missing are not reported again.
    [[nodiscard]] Result<std::vector<std::string>> checkAndAcknowledge(
        const std::function<void(const CheckProgress&)>& onProgress, const RunContext& context = {}) const;

    [[nodiscard]] Result<Stats> stats(const RunContext& context = {}) const;
    [[nodiscard]] Result<ServerInfo> serverInfo(const RunContext& context = {}) const;

    /// API keys take an admin key of all collections, or the server's Unix socket. Not retried: a key whose
    /// reply was lost is in `listKeys` and can be revoked. Errors: kInvalidArgument, kUnauthenticated,
    /// kPermissionDenied.
    [[nodiscard]] Result<CreatedKey> createKey(const KeyRequest& request,
                                               const RunContext& context = {}) const;
    /// The oldest first, those that were revoked or have expired included.
    [[nodiscard]] Result<std::vector<Key>> listKeys(const RunContext& context = {}) const;
    /// Errors: kNotFound (no such key, or it was revoked before).
    [[nodiscard]] Result<Key> revokeKey(const std::string& id, const RunContext& context = {}) const;

    /// State of one service by its full name ("shapedb.v1.SearchService"), or of the whole server if empty.
    /// Not retried. Errors: kNotFound.
    [[nodiscard]] Result<Health> health(const std::string& service = {},
                                        const RunContext& context = {}) const;

  private:
    struct Impl;
    explicit Client(std::unique_ptr<Impl> impl);

    std::unique_ptr<Impl> impl_;
};

/// Makes a full backup at `path` of a chain: the file of a full backup, and each increment after the one it
/// continues. Needs no server, nor memory for more than the hashes of the blocks that the increments bring.
/// Written under another name first; never one of the `files`. Reports the stages "read" (the full backup, to
/// be sure of it) and "merge" in bytes. Errors: kInvalidArgument (no increment, or an increment does not
/// continue the file before it: the message says what is missing), kMalformedFile (not an increment, or
/// damaged), kChecksumMismatch (not the full backup that the first increment continues, or damaged),
/// kFileNotReadable, kFileNotWritable, kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<BackupReport> mergeBackups(const std::vector<std::string>& files,
                                                const std::string& path, const RunContext& context = {});

}  // namespace shapedb::client
