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

/// The port of an address without one.
constexpr int kDefaultPort = 7878;

/// When a call that changes nothing by being made twice is made again: after the server could
/// not be reached or said that its queue is full, never after any other error. The wait before
/// try n is initialBackoff * multiplier^(n - 2), at most maxBackoff, and shortened or lengthened
/// at random by up to `jitter` of itself; when the server says how long to wait
/// (`grpc-retry-pushback-ms`), that is the wait. Tries are counted anew when the reason changes.
struct RetryPolicy {
    int maxAttempts = 5;       ///< while the server cannot be reached; at least 1; 1: never again
    int maxQueueAttempts = 5;  ///< while its queue is full; the same
    std::chrono::milliseconds initialBackoff{100};
    double multiplier = 2.0;  ///< at least 1
    std::chrono::milliseconds maxBackoff{5000};
    double jitter = 0.2;  ///< [0, 1]
};

struct ClientOptions {
    /// HOST, HOST:PORT, [IPV6]:PORT, or a name gRPC understands ("unix:/run/shapedb.sock").
    std::string address = "127.0.0.1:7878";
    /// What one call may take, all its tries together; 0: as long as it takes. Calls that follow
    /// work on the server (watchIngest, addShape with wait, rebuild, backup, restore, check)
    /// are bounded by the deadline of their RunContext alone.
    std::chrono::milliseconds deadline{60000};
    RetryPolicy retry{};
};

/// A connection to one server. It is made when first needed and again after it was lost.
///
/// Every call blocks until its answer is there. A RunContext cancels it (kCancelled, within
/// about 20 ms) and bounds it further (kDeadlineExceeded); uploads and downloads report progress
/// to it in bytes.
///
/// Errors of every call, not repeated below: those the server sends, by its own name and
/// message; kUnavailable when it cannot be reached; kDeadlineExceeded; kCancelled;
/// kOutOfMemory; kInternal. Scans are checked before they are sent: kTooFewPoints (none at all),
/// kNonFiniteCoordinate, and kCoordinateOutOfRange for what single precision cannot hold.
///
/// Thread-safety: all member functions may be called from any number of threads at once.
class Client {
  public:
    /// Does not touch the network. Errors: kInvalidArgument naming the option and its range.
    [[nodiscard]] static Result<Client> connect(ClientOptions options);

    ~Client();
    Client(Client&&) noexcept;
    Client& operator=(Client&&) noexcept;

    /// As connected to, with the port.
    [[nodiscard]] const std::string& address() const;

    // ------------------------------------------------------------------------------------ shapes

    /// Uploads one scan with its count and checksum, in chunks of at most 1 MiB. When it returns
    /// the scan is durable. The same key with the same points and metadata is the same shape, so
    /// it is retried unless expectedVersion is set.
    ///
    /// Points travel in single precision. When the scan lies so far from the origin that this
    /// would round away its detail (a coordinate beyond 16 times the diagonal of its bounding
    /// box, as in surveyed coordinates), the centre of the box is taken off first: the method
    /// does not depend on where a shape lies. The offset is returned and kept in the metadata
    /// under kOffsetKey; coordinates of this shape that the server returns are without it.
    [[nodiscard]] Result<AddReply> addShape(const AddRequest& request, const PointCloud& points,
                                            const RunContext& context = {}) const;

    /// Errors: kNotFound.
    [[nodiscard]] Result<Shape> getShape(const ShapeRef& shape, const RunContext& context = {}) const;

    /// One page. Errors: kNotFound, kMalformedFilter, kMalformedCursor, kInvalidArgument.
    [[nodiscard]] Result<ListPage> listShapes(const ListRequest& request,
                                              const RunContext& context = {}) const;

    /// How many shapes listShapes would give in all; page size and cursor do not matter.
    [[nodiscard]] Result<std::uint64_t> countShapes(const ListRequest& request,
                                                    const RunContext& context = {}) const;

    /// Removes shape, points and signature; returns the shape as it was. Not retried.
    /// Errors: kNotFound; kVersionConflict when `expectedVersion` is set and not the current one.
    [[nodiscard]] Result<Shape> deleteShape(const ShapeRef& shape,
                                            std::optional<std::int64_t> expectedVersion = {},
                                            const RunContext& context = {}) const;

    /// Calls `onEvent` with the current state and then with each change until the shape is
    /// kReady or kFailed; returns that last event. Errors: kNotFound.
    [[nodiscard]] Result<IngestEvent> watchIngest(const ShapeRef& shape,
                                                  const std::function<void(const IngestEvent&)>& onEvent,
                                                  const RunContext& context = {}) const;

    /// Errors: kNotFound, kNotReady.
    [[nodiscard]] Result<Signature> getSignature(const ShapeRef& shape, const RunContext& context = {}) const;

    /// The stored points with their segments. Errors: kNotFound, those of a segmentation.
    [[nodiscard]] Result<SegmentedScan> getSegments(const ShapeRef& shape,
                                                    const RunContext& context = {}) const;

    /// Segments a scan on the server without storing it. The points returned are as they
    /// travelled: see addShape. Errors: those of a segmentation.
    [[nodiscard]] Result<SegmentedScan> segment(const PointCloud& points, const Parameters& parameters,
                                                bool summaryOnly, const RunContext& context = {}) const;

    // ------------------------------------------------------------------------------------ search

    /// Errors of the searches: kNotFound, kNotReady, kInvalidArgument (k, threshold),
    /// kMalformedFilter, kMalformedSignature.
    [[nodiscard]] Result<SearchReply> searchByKey(const SearchOptions& options, const std::string& key,
                                                  bool includeSelf = false,
                                                  const RunContext& context = {}) const;

    /// The query travels as in addShape; motions lead to its coordinates without the offset.
    [[nodiscard]] Result<SearchReply> searchByScan(const SearchOptions& options, const PointCloud& points,
                                                   const RunContext& context = {}) const;

    [[nodiscard]] Result<SearchReply> searchBySignature(const SearchOptions& options,
                                                        const std::string& encodedSignature,
                                                        const RunContext& context = {}) const;

    /// Answers in the order of the queries; the first error ends the call and names its query.
    [[nodiscard]] Result<std::vector<SearchReply>> searchBatch(const SearchOptions& options,
                                                               const std::vector<BatchQuery>& queries,
                                                               const RunContext& context = {}) const;

    [[nodiscard]] Result<Comparison> compare(const ShapeRef& query, const ShapeRef& other,
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

    /// With every shape in it. Not retried. Errors: kNotFound; kRejected when it holds shapes and
    /// `force` is false.
    [[nodiscard]] Result<void> deleteCollection(const std::string& name, bool force,
                                                const RunContext& context = {}) const;

    // ------------------------------------------------------------------------------------- admin

    /// Follows a rebuild until it is done; calls `onProgress` on the way and returns its last
    /// word on each collection. The rebuild goes on when the call is cancelled or lost; calling
    /// again follows it. Errors: kNotFound; kRejected when one with other parameters runs.
    [[nodiscard]] Result<std::vector<RebuildProgress>> rebuild(
        const RebuildRequest& request, const std::function<void(const RebuildProgress&)>& onProgress,
        const RunContext& context = {}) const;

    /// Not retried. Errors: kNotFound: none is running.
    [[nodiscard]] Result<void> cancelRebuild(const std::string& collection,
                                             const RunContext& context = {}) const;

    /// Writes a consistent copy of the database to `path`: under another name first, and renamed
    /// when it is complete and its checksum is right. Errors: kFileNotWritable,
    /// kChecksumMismatch, kCountMismatch.
    [[nodiscard]] Result<BackupReport> backupToFile(const std::string& path,
                                                    const RunContext& context = {}) const;

    /// Replaces everything on the server by the backup at `path`. Not retried.
    /// Errors: kFileNotReadable.
    [[nodiscard]] Result<RestoreReport> restoreFromFile(const std::string& path,
                                                        const RunContext& context = {}) const;

    /// Reads the whole database; the problems it found, one line each, none when it is sound.
    [[nodiscard]] Result<std::vector<std::string>> check(
        const std::function<void(const CheckProgress&)>& onProgress, const RunContext& context = {}) const;

    [[nodiscard]] Result<Stats> stats(const RunContext& context = {}) const;
    [[nodiscard]] Result<ServerInfo> serverInfo(const RunContext& context = {}) const;

    /// Of one service by its full name ("shapedb.v1.SearchService"), or of the server as a whole
    /// when empty. Not retried: an answer late is no answer. Errors: kNotFound.
    [[nodiscard]] Result<Health> health(const std::string& service = {},
                                        const RunContext& context = {}) const;

  private:
    struct Impl;
    explicit Client(std::unique_ptr<Impl> impl);

    std::unique_ptr<Impl> impl_;
};

}  // namespace shapedb::client
