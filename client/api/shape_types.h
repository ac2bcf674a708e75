// SPDX-License-Identifier: Apache-2.0
// What the client library takes and returns about stored shapes; part of types.h.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/metadata.h"
#include "core/geometry/point.h"

namespace shapedb::client {

using shapedb::Metadata;

/// The clock's own nanoseconds end in the year 2262, before keys may.
using Timestamp = std::chrono::time_point<std::chrono::system_clock, std::chrono::microseconds>;

[[nodiscard]] inline Timestamp currentTime() {
    return std::chrono::floor<Timestamp::duration>(std::chrono::system_clock::now());
}

/// Names one shape. An empty collection is "default".
struct ShapeRef {
    std::string collection;
    std::string key;
};

enum class ShapeState {
    kPending,  ///< on disk; waiting to be segmented, or being segmented
    kReady,    ///< found by searches
    kFailed,   ///< could not be segmented; `failure` says why
};

/// "pending", "ready" or "failed".
[[nodiscard]] const char* stateName(ShapeState state) noexcept;

/// What the server knows about one shape, without its points.
struct Shape {
    std::string collection;
    std::string key;           ///< chosen by the client, unique in the collection
    std::int64_t id = 0;       ///< given by the server, rising; breaks ties in rankings
    std::int64_t version = 0;  ///< 1 when inserted, one more with every change
    ShapeState state = ShapeState::kPending;
    std::uint64_t pointCount = 0;
    std::string sha256;  ///< 32 bytes, of the points as sent, so relative to `origin`
    Metadata metadata;
    Timestamp created;
    Timestamp updated;
    std::optional<Error> failure;  ///< set exactly when state is kFailed
    /// How certain the interior is, [0, 1]. Set when state is kReady and the signature has attributes.
    std::optional<double> quality;
    /// What the points were sent relative to (see Client::addShape); usually zero.
    Point3 origin;
    /// Of addShape, getShape and deleteShape, where several servers share a database: with it as
    /// SearchOptions::atLeast, a search on any of them knows the shape as it is here. Otherwise 0.
    std::int64_t change = 0;
};

enum class AddMode {
    kUpsert,      ///< insert or replace
    kInsertOnly,  ///< kAlreadyExists if another shape has the key
    kUpdateOnly,  ///< kNotFound if no shape has the key
    kSamePoints,  ///< kAlreadyExists if a shape with other points has the key
};

struct AddRequest {
    ShapeRef shape{};
    AddMode mode = AddMode::kUpsert;
    /// What the shape has afterwards. Not set: a shape that has the key keeps what it has.
    std::optional<Metadata> metadata{};
    /// If set, the version the shape must have now; 0: the key must be free. Such a call is not retried: a
    /// first try whose reply was lost may have changed the version.
    std::optional<std::int64_t> expectedVersion{};
    /// Return only when the shape is kReady or kFailed.
    bool wait = false;
};

enum class AddOutcome {
    kCreated,
    kReplaced,         ///< new points: segmented again
    kMetadataChanged,  ///< same points, new metadata
    kUnchanged,        ///< same points, same metadata: a repeated request
    kRetried,          ///< same points of a shape that had failed: segmented again
};

/// "created", "replaced", "metadata changed", "unchanged" or "retried".
[[nodiscard]] const char* outcomeName(AddOutcome outcome) noexcept;

struct AddReply {
    AddOutcome outcome = AddOutcome::kCreated;
    Shape shape;
};

enum class ShapeOrder {
    kId,
    kKey,      ///< byte by byte
    kUpdated,  ///< by time of change, ties by id; a shape that changes meanwhile moves
};

struct ListRequest {
    std::string collection{};
    std::string filter{};               ///< docs/filters.md; empty: all
    std::optional<ShapeState> state{};  ///< not set: any state
    std::uint32_t pageSize = 0;         ///< 1 to 1,000; 0: 100
    std::string cursor{};               ///< nextCursor of the previous page
    std::string keyPrefix{};            ///< only shapes whose key begins with this
    ShapeOrder order = ShapeOrder::kId;
    bool descending = false;
};

struct ListPage {
    std::vector<Shape> shapes;  ///< in the order of the request
    std::string nextCursor;     ///< empty on the last page
};

/// One step of an ingest, as watchIngest reports it.
struct IngestEvent {
    ShapeState state = ShapeState::kPending;
    std::string stage;  ///< while kPending: "queued", or the stage that is running
    std::uint64_t done = 0;
    std::uint64_t total = 0;  ///< in the stage's own unit; 0: unknown
    std::optional<Error> failure;
    std::optional<double> quality;  ///< when kReady: Shape::quality
};

struct FoundShapes {
    std::vector<Shape> shapes;         ///< in the order of the keys
    std::vector<std::string> missing;  ///< keys that no shape has
};

/// The points of a shape as they are stored.
struct StoredPoints {
    Shape shape;  ///< as of when the points were read
    /// Where they were scanned: what was sent, in single precision, with shape.origin added.
    PointCloud points;
};

/// Some points of a shape, enough for a small picture.
struct Preview {
    std::string key;
    std::int64_t version = 0;  ///< Shape::version: which points these were made of
    /// About the middle of the box of the scan. None if the shape has no surface points (yet), as with
    /// profile "paper".
    PointCloud points;
    PointCloud normals;  ///< of each point; n may as well be -n
};

struct ValueCountRequest {
    std::string collection{};
    std::string metadataKey{};  ///< whose values are counted
    std::string filter{};
    std::optional<ShapeState> state{};
    std::uint32_t maxValues = 0;  ///< to name, up to 1,000; 0: 100
};
struct ValueCount {
    std::string value;
    std::uint64_t shapes = 0;
};
struct ValueCounts {
    std::vector<ValueCount> values;  ///< most shapes first, ties by value
    std::uint64_t otherValues = 0;   ///< beyond maxValues
    std::uint64_t otherShapes = 0;   ///< that have those
    std::uint64_t without = 0;       ///< shapes without the key
};

/// The shapes of one collection that a call is about. An empty collection is "default".
struct ShapeSelection {
    std::string collection{};
    std::vector<std::string> keys{};      ///< up to 1,000; used when `filter` is not set
    std::optional<std::string> filter{};  ///< docs/filters.md; set and empty: all shapes of the collection
};

struct DeleteReply {
    std::uint64_t deleted = 0;
    std::vector<std::string> missing;  ///< keys that no shape had
};

struct RetryReply {
    std::uint64_t queued = 0;
    std::uint64_t left = 0;              ///< for want of room in the ingest queue: call again later
    std::vector<std::string> notFailed;  ///< keys
    std::vector<std::string> missing;    ///< keys that no shape has
};

/// How the metadata of a shape change.
struct MetadataChange {
    Metadata set{};                     ///< in place of what the shape has under these keys
    std::vector<std::string> remove{};  ///< keys; those it does not have are ignored
    /// The shape keeps only what `set` has, and what is under keys that begin with "shapedb.".
    bool replaceAll = false;
};

struct MetadataReply {
    std::uint64_t changed = 0;
    std::uint64_t unchanged = 0;  ///< had this metadata before
    std::uint64_t refused = 0;    ///< left as they were: they would have had too many entries
    std::string firstRefusedKey;
    std::optional<Error> firstRefused;
    std::optional<Shape> shape;  ///< of a change by key: as it is now
};

}  // namespace shapedb::client
