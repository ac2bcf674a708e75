// Everything the client library takes and returns, as plain values. The wire messages they
// stand for, with every limit, are in proto/shapedb/v1/.
//
// All types are copyable, own what they hold and have no invariants beyond the comments.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb::client {

/// Labels and other facts of a shape. At most 64; keys 1 to 128 bytes of [A-Za-z0-9_.-], values
/// up to 1,024 bytes of UTF-8.
using Metadata = std::map<std::string, std::string>;

using Timestamp = std::chrono::system_clock::time_point;

/// The metadata key under which an upload records the offset it took off the coordinates:
/// three numbers separated by blanks, in scan units. See Client::addShape.
constexpr const char* kOffsetKey = "shapedb.offset";

/// Which published form of the method is used.
enum class Profile {
    kDefault,  ///< what we recommend: the method made to stand noise, outliers and uneven density
    kPaper,    ///< Dey and Goswami 2004 as published: all points, as they are
};

/// How the interior of a shape is told from its outside.
enum class InteriorMethod {
    kWalk,      ///< the paper's walk with one fixed angle; nothing left inside is an error
    kAdaptive,  ///< decided from the shape itself; always an interior, with a quality figure
};

/// What decides the signature of a scan. What is not set is the profile's default when a
/// collection is created or a scan is segmented, and left as it is by a rebuild.
struct Parameters {
    std::optional<Profile> profile;
    std::optional<double> bigBallRatio;       ///< the paper's rho, > 0
    std::optional<double> deepAngleDegrees;   ///< degrees, in (0, 90)
    std::optional<double> hullAngleDegrees;   ///< degrees, in (0, 90)
    std::optional<double> mergeRatio;         ///< >= 1
    std::optional<std::uint32_t> decimateTo;  ///< grid cells, >= 4; 0: never average
    /// >= 1: segments merge by contrast up to this; 0: by mergeRatio.
    std::optional<double> mergeContrast;
    std::optional<double> minSegmentShare;         ///< of all volume, [0, 1]; with mergeContrast
    std::optional<std::uint32_t> maxSegments;      ///< with mergeContrast; 0: no limit
    std::optional<double> outlierRatio;            ///< > 1; 0: no point is left out
    std::optional<double> smoothingReach;          ///< in deviations of the noise, [1, 20]; 0: off
    std::optional<double> thinning;                ///< (0, 10]; 0: no point is thinned away
    std::optional<InteriorMethod> interiorMethod;  ///< how the interior is found
    std::optional<std::uint32_t> maxPoints;        ///< heaviest segments kept, 1 to 16
    std::optional<bool> attributes;                ///< false: points and weights alone, as published
};

/// Names one shape. An empty collection is "default".
struct ShapeRef {
    std::string collection;
    std::string key;
};

enum class ShapeState {
    kPending,  ///< stored durably, waiting for or in segmentation
    kReady,    ///< found by searches
    kFailed,   ///< cannot be segmented; `failure` says why
};

/// "pending", "ready" or "failed".
[[nodiscard]] const char* stateName(ShapeState state) noexcept;

/// What the server knows of one shape, without its points.
struct Shape {
    std::string collection;
    std::string key;           ///< the client's own id, unique in the collection
    std::int64_t id = 0;       ///< the server's id: rises with insertion, breaks ties in rankings
    std::int64_t version = 0;  ///< 1 at first insert, plus 1 on every change
    ShapeState state = ShapeState::kPending;
    std::uint64_t pointCount = 0;
    std::string sha256;  ///< 32 bytes, of the points as they travel
    Metadata metadata;
    Timestamp created;
    Timestamp updated;
    std::optional<Error> failure;  ///< set exactly when state is kFailed
    /// How well the interior could be told from the outside, [0, 1]; not set without a signature
    /// that has attributes.
    std::optional<double> quality;
};

enum class AddMode {
    kUpsert,      ///< insert or replace
    kInsertOnly,  ///< kAlreadyExists when the key is taken by another shape
    kUpdateOnly,  ///< kNotFound when the key is free
};

struct AddRequest {
    ShapeRef shape{};
    AddMode mode = AddMode::kUpsert;
    Metadata metadata{};
    /// When set, the version the shape must have now; 0: the key must be free. A call with
    /// this set is not retried: the lost first try may have changed the version.
    std::optional<std::int64_t> expectedVersion{};
    /// Return only when the shape is kReady or kFailed.
    bool wait = false;
};

enum class AddOutcome {
    kCreated,
    kReplaced,         ///< other points than before: segmented again
    kMetadataChanged,  ///< same points, other metadata
    kUnchanged,        ///< same points, same metadata: a repeated request
};

/// "created", "replaced", "metadata changed" or "unchanged".
[[nodiscard]] const char* outcomeName(AddOutcome outcome) noexcept;

struct AddReply {
    AddOutcome outcome = AddOutcome::kCreated;
    Shape shape;
    Point3 offset;  ///< taken off the coordinates before upload, scan units; often zero
};

struct ListRequest {
    std::string collection{};
    std::string filter{};               ///< docs/filters.md; empty: all
    std::optional<ShapeState> state{};  ///< not set: any
    std::uint32_t pageSize = 0;         ///< 1 to 1,000; 0: 100
    std::string cursor{};               ///< nextCursor of the page before
};

struct ListPage {
    std::vector<Shape> shapes;  ///< by rising id
    std::string nextCursor;     ///< empty on the last page
};

/// One step of an ingest as WatchIngest tells it.
struct IngestEvent {
    ShapeState state = ShapeState::kPending;
    std::string stage;  ///< while kPending: "queued", or the stage being run
    std::uint64_t done = 0;
    std::uint64_t total = 0;  ///< in the stage's own unit; 0: unknown
    std::optional<Error> failure;
    std::optional<double> quality;  ///< when kReady: Shape::quality
};

/// One segment of a shape as its signature keeps it.
struct WeightedPoint {
    Point3 position;             ///< volume-weighted centroid, scan units
    double weight = 0.0;         ///< volume of the segment, scan units cubed
    double volumeShare = 0.0;    ///< of the whole interior, (0, 1]
    double maximumRadius = 0.0;  ///< of the largest Delaunay ball, scan units
    /// Standard deviations of the segment's matter along its principal axes, falling, scan units.
    std::array<double, 3> extents{};
};

/// One histogram that no rotation, reflection, translation or scale changes.
struct ShapeStatistic {
    std::string name;           ///< for people: "chords"
    std::vector<float> shares;  ///< of each bin, [0, 1]
    bool ofInterior = false;    ///< false: of the surface alone, good for open scans too
};

/// What a signature knows of a shape beyond its weighted points.
struct ShapeAttributes {
    double quality = 0.0;                    ///< of the interior, [0, 1]
    std::vector<ShapeStatistic> statistics;  ///< empty in SearchReply::query
};

struct Signature {
    std::vector<WeightedPoint> points;  ///< by falling weight; never empty
    double scale = 0.0;                 ///< diagonal of the bounding box, scan units
    double volume = 0.0;                ///< of the whole interior, scan units cubed
    std::string encoded;                ///< what searchBySignature takes
    std::optional<ShapeAttributes> attributes;
};

/// Where an interior comes from.
enum class InteriorSource {
    kWalk,       ///< what a walk from outside leaves
    kPotential,  ///< what the potential puts inside: a walk would leak in, or be shut out of a cavity
    kThickened,  ///< no side can be told: the neighbourhood of the points
};

/// "walk", "potential" or "thickened".
[[nodiscard]] const char* sourceName(InteriorSource source) noexcept;

struct StageTime {
    std::string stage;
    double seconds = 0.0;
};

/// How long and how much each stage of a segmentation took.
struct SegmentationReport {
    std::uint64_t points = 0;
    std::uint64_t pointsUsed = 0;  ///< after leaving out outliers, merging duplicates and thinning
    std::uint64_t duplicates = 0;
    std::uint64_t outliers = 0;  ///< points left out
    /// How well the interior could be told from the outside, [0, 1]. Always 1 with kWalk.
    double quality = 1.0;
    InteriorSource interiorSource = InteriorSource::kWalk;
    double angleDegrees = 0.0;  ///< deep angle of the walk; 0 when the interior comes from elsewhere
    double noise = 0.0;         ///< estimated before smoothing, scan units; 0: not measured
    std::uint64_t tetrahedra = 0;
    std::uint64_t interiorTetrahedra = 0;
    std::uint64_t maxima = 0;  ///< segments before merging
    std::uint64_t segments = 0;
    double volume = 0.0;  ///< scan units cubed
    double delaunaySeconds = 0.0;
    double totalSeconds = 0.0;
    std::vector<StageTime> stages;
};

/// A scan with the segment of each point.
struct SegmentedScan {
    SegmentationReport report;
    Signature signature;
    PointCloud points;                   ///< as uploaded, in order; empty for a summary
    std::vector<std::int32_t> segments;  ///< by point: place by falling volume, -1: none
};

struct SearchOptions {
    std::string collection{};
    std::uint32_t k = 10;     ///< 1 to the server's limit
    double threshold = 0.0;   ///< hits have at least this score, [0, 1]
    std::string filter{};     ///< the k best of those that pass
    bool reflection = true;   ///< false tells left from right
    bool keepScale = false;   ///< true compares sizes too
    bool partial = false;     ///< true: the query may be a one-sided scan or a piece of a hit
    bool explanation = true;  ///< false leaves out motion and matches of each hit
};

struct CompareOptions {
    bool reflection = true;  ///< false tells left from right
    bool keepScale = false;  ///< true compares sizes too
    bool partial = false;    ///< true: how much of the query is contained in the other
};

/// Two segments that an alignment lays on each other.
struct SegmentMatch {
    std::uint32_t query = 0;  ///< index into the query's Signature::points
    std::uint32_t hit = 0;    ///< index into the hit's
    double share = 0.0;       ///< of the similarity, [0, 1]
    double distance = 0.0;    ///< after the motion, in units of the common scale
};

/// One of the distances a score of signatures with attributes is made of.
struct ScoreTerm {
    std::string name;       ///< of a statistic, "parts", or of a partial score "contained parts"
    double distance = 0.0;  ///< 1: as far as two unrelated shapes typically differ
    double weight = 0.0;    ///< in the mean; all terms' sum to 1
};

/// Why two shapes have their score.
struct Explanation {
    double similarity = 0.0;
    double dissimilarity = 0.0;
    Motion motion;                      ///< coordinates of the hit to coordinates of the query
    std::vector<SegmentMatch> matches;  ///< by falling share
    std::vector<std::uint32_t> unmatchedQuery;
    std::vector<std::uint32_t> unmatchedHit;
    bool degenerate = false;       ///< a single-segment signature left the rotation open
    std::vector<ScoreTerm> terms;  ///< empty unless both signatures have attributes
};

struct Hit {
    Shape shape;
    double score = 0.0;                      ///< [0, 1]; 1 exactly for identical signatures
    std::optional<Explanation> explanation;  ///< unless the options leave it out
};

struct SearchReply {
    std::vector<Hit> hits;         ///< by falling score, equal scores by rising id
    std::uint64_t candidates = 0;  ///< signatures in the snapshot searched
    std::uint64_t filtered = 0;    ///< of these, passed the filter
    std::uint64_t scored = 0;      ///< of these, scored in full
    Signature query;               ///< as it was scored
    double secondsSegment = 0.0;   ///< searchByScan only
    double secondsSearch = 0.0;
    std::optional<SegmentationReport> report;  ///< searchByScan only
    Point3 offset;  ///< taken off the query's coordinates before upload; often zero
};

/// One query of a batch: a stored shape (itself left out), or a signature taken before.
struct BatchQuery {
    std::string key{};        ///< used when `signature` is empty
    std::string signature{};  ///< Signature::encoded
};

struct Comparison {
    double score = 0.0;
    Explanation explanation;
    Signature query;
    Signature other;
};

struct Collection {
    std::string name;  ///< 1 to 128 bytes of [A-Za-z0-9_.-], starting with a letter or digit
    std::string description;
    Parameters parameters;        ///< in full: every field is set
    std::int64_t generation = 0;  ///< raised by one by each finished rebuild
    Timestamp created;
    std::uint64_t shapes = 0;  ///< in any state
    std::uint64_t shapesReady = 0;
    std::uint64_t shapesFailed = 0;
};

struct RebuildRequest {
    std::string collection;  ///< empty: all, one after the other
    bool cacheOnly = false;  ///< only reload the cache from the stored signatures
    Parameters parameters;   ///< new ones; needs a collection
    bool detach = false;     ///< return after the first message
};

struct RebuildProgress {
    std::string collection;
    std::uint64_t done = 0;
    std::uint64_t total = 0;
    std::uint64_t failed = 0;  ///< of done: could not be segmented
    bool finished = false;     ///< of this collection
    double seconds = 0.0;
};

struct BackupReport {
    std::uint64_t bytes = 0;
    std::string sha256;  ///< 32 bytes
};

struct RestoreReport {
    std::uint64_t collections = 0;
    std::uint64_t shapes = 0;
};

struct CheckProgress {
    std::uint64_t done = 0;
    std::uint64_t total = 0;
    std::vector<std::string> problems;  ///< found since the message before, one line each
    bool finished = false;
};

struct Stats {
    std::uint64_t collections = 0;
    std::uint64_t shapesPending = 0;
    std::uint64_t shapesReady = 0;
    std::uint64_t shapesFailed = 0;
    std::uint64_t cachedSignatures = 0;
    std::uint64_t cacheBytes = 0;
    std::uint64_t queuedJobs = 0;
    std::uint64_t queuedBytes = 0;
    std::uint64_t runningJobs = 0;
    std::uint64_t databaseBytes = 0;
    std::uint64_t walBytes = 0;
    std::uint64_t pointBytes = 0;        ///< uncompressed
    std::uint64_t storedPointBytes = 0;  ///< as compressed
    double uptimeSeconds = 0.0;
    std::uint64_t searches = 0;  ///< since start
    std::uint64_t ingested = 0;  ///< since start
};

/// What a request may ask at most.
struct Limits {
    std::uint64_t maxPoints = 0;
    std::uint32_t maxK = 0;
    std::uint32_t maxBatch = 0;
    std::uint64_t maxQueuedJobs = 0;
    std::uint64_t maxQueuedBytes = 0;
    std::uint32_t maxChunkBytes = 0;
};

struct ServerInfo {
    std::string version;
    std::int32_t schemaVersion = 0;
    Timestamp started;
    Limits limits;
    std::uint32_t ingestThreads = 0;
};

/// What grpc.health.v1 says of a service.
enum class Health { kUnknown, kServing, kNotServing };

}  // namespace shapedb::client
