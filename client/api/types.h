// SPDX-License-Identifier: Apache-2.0
// What the client library takes and returns, as plain values: copyable, owning, with no invariants beyond the
// comments. proto/shapedb/v1/ has the messages behind them, with every limit.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/api/shape_types.h"
#include "core/base/error.h"
#include "core/base/length_unit.h"
#include "core/fit/verdict_kinds.h"
#include "core/geometry/motion.h"
#include "core/geometry/point.h"
#include "core/profile.h"
#include "core/segmentation/interior_kinds.h"

namespace shapedb::client {

using shapedb::InteriorDoubt;
using shapedb::InteriorMethod;
using shapedb::InteriorSource;
using shapedb::Profile;

/// What decides the signature of a scan. A field that is not set takes the profile's value when a collection
/// is created or a scan segmented, and keeps its value in a rebuild.
struct Parameters {
    std::optional<Profile> profile;
    std::optional<double> bigBallRatio;       ///< the paper's rho, > 0
    std::optional<double> deepAngleDegrees;   ///< degrees, in (0, 90)
    std::optional<double> hullAngleDegrees;   ///< degrees, in (0, 90)
    std::optional<double> mergeRatio;         ///< >= 1
    std::optional<std::uint32_t> decimateTo;  ///< grid cells, >= 4; 0: do not average
    /// >= 1: merge segments by contrast, up to this; 0: merge by mergeRatio.
    std::optional<double> mergeContrast;
    std::optional<double> minSegmentShare;     ///< of the whole volume, [0, 1]; with mergeContrast
    std::optional<std::uint32_t> maxSegments;  ///< with mergeContrast; 0: no limit
    std::optional<double> outlierRatio;        ///< > 1; 0: keep outliers
    std::optional<double> smoothingReach;      ///< in standard deviations of the noise, [1, 20]; 0: off
    std::optional<double> thinning;            ///< (0, 10]; 0: off
    std::optional<InteriorMethod> interiorMethod;
    std::optional<std::uint32_t> maxPoints;  ///< heaviest segments kept, 1 to 16
    std::optional<bool> attributes;          ///< false: points and weights alone, as published
    std::optional<bool> views;               ///< keep views, so that scans of one side find the shape
    std::optional<LengthUnit> unit;          ///< of the scans of a collection: with one, sizes count
};

/// One segment of a shape, as its signature keeps it.
struct WeightedPoint {
    Point3 position;             ///< volume-weighted centroid, scan units
    double weight = 0.0;         ///< volume of the segment, scan units cubed
    double volumeShare = 0.0;    ///< of the whole interior, (0, 1]
    double maximumRadius = 0.0;  ///< of the largest Delaunay ball, scan units
    /// Standard deviations of the segment's volume along its principal axes, largest first, scan units.
    std::array<double, 3> extents{};
};

/// One histogram that no rotation, reflection, translation or scale changes.
struct ShapeStatistic {
    std::string name;           ///< for people, e.g. "chords"
    std::vector<float> shares;  ///< one per bin, [0, 1]
    bool ofInterior = false;    ///< false: of the surface alone, so valid for open scans too
};

/// What a signature knows about a shape beyond its weighted points.
struct ShapeAttributes {
    double quality = 0.0;                    ///< of the interior, [0, 1]
    std::vector<ShapeStatistic> statistics;  ///< empty in SearchReply::query
};

struct Signature {
    std::vector<WeightedPoint> points;  ///< in descending order of weight; never empty
    double scale = 0.0;                 ///< diagonal of the bounding box, scan units
    double volume = 0.0;                ///< of the whole interior, scan units cubed
    std::string encoded;                ///< what searchBySignature takes
    std::optional<ShapeAttributes> attributes;
};

struct StageTime {
    std::string stage;
    double seconds = 0.0;
};

/// What a segmentation did, and how long its stages took.
struct SegmentationReport {
    std::uint64_t points = 0;
    std::uint64_t pointsUsed = 0;  ///< without outliers and duplicates, after averaging and thinning
    std::uint64_t duplicates = 0;
    std::uint64_t outliers = 0;         ///< points dropped
    std::uint64_t outlierClusters = 0;  ///< separate groups of nine points or more among them
    /// How certain the interior is, [0, 1]. InteriorMethod::kWalk does not assess it: always 1.
    double quality = 1.0;
    InteriorSource interiorSource = InteriorSource::kWalk;
    /// Why the interior is not to be trusted, beyond its quality.
    InteriorDoubt doubt = InteriorDoubt::kNone;
    double angleDegrees = 0.0;  ///< deep angle of the walk; 0 for other sources
    double noise = 0.0;  ///< standard deviation estimated before smoothing, scan units; 0: not measured
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
    PointCloud points;                   ///< where they were scanned, in order; empty for a summary
    std::vector<std::int32_t> segments;  ///< per point, 0 being the largest segment; -1: none
};

struct SearchOptions {
    std::string collection{};
    std::uint32_t k = 10;     ///< 1 to the server's limit
    double threshold = 0.0;   ///< lowest score of a hit, [0, 1]
    std::string filter{};     ///< applied first: the k best of those that pass
    bool reflection = true;   ///< false: a mirror image is another shape
    bool keepScale = false;   ///< true: size matters, as it does anyway in a collection with a unit
    bool freeScale = false;   ///< true: not there either
    bool partial = false;     ///< true: the query may be a one-sided scan or a broken piece of a hit
    bool explanation = true;  ///< false: no motion and no matches with the hits
    /// Whether the best candidates are laid on the query; nothing: yes, but not in collections of profile
    /// `paper`.
    std::optional<bool> verify;
    std::uint32_t verifyCandidates = 0;  ///< how many at most; 0: the server's default
    std::optional<bool> oneSided;        ///< a camera saw the query from one place; nothing: judged
    std::optional<Point3> viewpoint;     ///< where it stood, in coordinates of the query
    /// A metadata key: the k groups of shapes with the same value under it (those without the key are one)
    /// whose best hits are best. Empty: no groups.
    std::string groupBy{};
    std::uint32_t perGroup = 0;  ///< hits of each group, 1 to 100; 0: 1
    /// A Shape::change that the answer must know, where several servers share a database: kUnavailable if
    /// the one that is asked does not hear of it in time. 0: whatever it knows.
    std::int64_t atLeast = 0;
    /// Where several servers hold parts of the collection and some are missing: answer without them, see
    /// SearchReply::covered. Otherwise kUnavailable.
    bool allowPartial = false;
};

struct CompareOptions {
    bool reflection = true;  ///< false: a mirror image is another shape
    /// true: size matters, as it does anyway where all stored shapes are in collections with one unit
    bool keepScale = false;
    bool freeScale = false;  ///< true: not there either
    bool partial = false;    ///< true: score how much of the query the other contains
};

/// Two segments that the alignment brings together.
struct SegmentMatch {
    std::uint32_t query = 0;  ///< index into the query's Signature::points
    std::uint32_t hit = 0;    ///< index into the hit's
    double share = 0.0;       ///< of the similarity, [0, 1]
    double distance = 0.0;    ///< of the centres after the motion, in units of the common scale
};

/// One of the distances that make up the score of two signatures with attributes.
struct ScoreTerm {
    std::string name;       ///< of a statistic, or "parts"; in a partial score "contained parts"
    double distance = 0.0;  ///< 0: identical; 1: typical of unrelated shapes
    double weight = 0.0;    ///< in the mean; the weights sum to 1
};

/// Why two shapes have the score they have.
struct Explanation {
    double similarity = 0.0;
    double dissimilarity = 0.0;
    Motion motion;                      ///< from coordinates of the hit to those of the query
    std::vector<SegmentMatch> matches;  ///< in descending order of share
    std::vector<std::uint32_t> unmatchedQuery;
    std::vector<std::uint32_t> unmatchedHit;
    bool degenerate = false;       ///< one of the two is a single segment: any rotation fits
    std::vector<ScoreTerm> terms;  ///< empty unless both signatures have attributes
};

/// One way of laying a shape on the query (docs/fit.md).
struct FitPose {
    Motion motion;                ///< from coordinates of the shape to those of the query
    double score = 0.0;           ///< [0, 1]: root of the product of the next two
    double explainedQuery = 0.0;  ///< share of the query's surface that lies on the shape's, [0, 1]
    /// The same of the part of the shape's surface that the query should have seen.
    double explainedOther = 0.0;
    /// Root of the mean squared distance of the query's points from the shape, where they are near it, as a
    /// share of the query's diagonal.
    double residual = 0.0;
};

/// Any turn about this line is as good.
struct FreeAxis {
    Point3 point;      ///< query coordinates
    Point3 direction;  ///< unit vector
};

/// What the query was taken for.
enum class FitKind { kWhole, kOneSided, kPiece };

/// How a shape lies on the query.
struct Fit {
    FitPose best;
    FitKind kind = FitKind::kWhole;
    double misfit = 0.0;                ///< 0: the shapes coincide; about 1: typical of unrelated shapes
    double certainty = 0.0;             ///< [0, 1]: 0 if a clearly different pose is as good
    bool handednessOpen = false;        ///< the points do not tell left from right
    std::vector<FitPose> alternatives;  ///< clearly different poses as good, best first; 4 at most
    std::vector<FreeAxis> axes;         ///< one for a bottle, three for a ball
};

/// How a shape lies on a scan.
struct Alignment : Fit {
    LengthUnit unit = LengthUnit::kNone;  ///< of its lengths: that of the stored shape's collection
};

struct Hit {
    Shape shape;
    double score = 0.0;                      ///< [0, 1]; 1 exactly for identical signatures
    double signatureScore = 0.0;             ///< what the signatures alone say; the same if not verified
    std::optional<Explanation> explanation;  ///< unless the options leave it out
    std::optional<Fit> fit;                  ///< if it was verified
    Verdict verdict = Verdict::kNone;        ///< what the hit is to the query
    double verdictReliability = 0.0;  ///< how often such a verdict was right where it was measured, [0, 1]
};

/// Hits with the same value under SearchOptions::groupBy.
struct HitGroup {
    std::optional<std::string> value;  ///< not set: their shapes do not have the key
    std::size_t hits = 0;
};

struct SearchReply {
    /// In descending order of score; ties in ascending order of id. With groups group after group, in the
    /// order of their best hits, and so within each.
    std::vector<Hit> hits;
    std::vector<HitGroup> groups;  ///< with SearchOptions::groupBy: of the hits, in their order
    std::uint64_t candidates = 0;  ///< shapes in the snapshot searched
    std::uint64_t filtered = 0;    ///< of these, how many pass the filter
    std::uint64_t scored = 0;      ///< of these, how many no bound ruled out
    std::uint64_t verified = 0;    ///< candidates that were laid on the query
    bool exact = true;             ///< false: verifying more candidates could change the hits
    std::uint64_t pending = 0;     ///< shapes of the collection that have no signature yet
    /// The unit of all lengths: that of the collection.
    LengthUnit unit = LengthUnit::kNone;
    /// Mirror images were to count as different (SearchOptions::reflection), but nothing was laid on the
    /// query: they score nearly alike.
    bool leftRightUntold = false;
    double covered = 1.0;         ///< share of the collection that was searched; 1 unless allowPartial
    Signature query;              ///< as it was scored
    double secondsSegment = 0.0;  ///< searchByScan only
    double secondsSearch = 0.0;
    std::optional<SegmentationReport> report;  ///< searchByScan only
};

/// One query of a batch: a stored shape (left out of its own hits), or an encoded signature.
struct BatchQuery {
    std::string key{};        ///< used when `signature` is empty
    std::string signature{};  ///< Signature::encoded
};

struct Comparison {
    double score = 0.0;           ///< as that of a hit of a verified search
    double signatureScore = 0.0;  ///< of the signatures
    Explanation explanation;
    Signature query;
    Signature other;
    std::optional<Fit> fit{};  ///< how `other` lies on `query`, if both have surface points
    Verdict verdict = Verdict::kNone;
    double verdictReliability = 0.0;  ///< as in Hit
    /// The unit of all lengths; kNone if the two shapes are in collections of different units: then each has
    /// its own.
    LengthUnit unit = LengthUnit::kNone;
    bool leftRightUntold = false;  ///< as in SearchReply
};

struct Collection {
    std::string name;  ///< 1 to 128 bytes of [A-Za-z0-9_.-], starting with a letter or digit
    std::string description;
    Parameters parameters;        ///< every field is set
    std::int64_t generation = 0;  ///< one more with every finished rebuild
    Timestamp created;
    std::uint64_t shapes = 0;  ///< in any state
    std::uint64_t shapesReady = 0;
    std::uint64_t shapesFailed = 0;
    std::vector<std::string> aliases;  ///< other names that stand for it, in ascending order
    /// Why it cannot be searched, and what to do; empty: it can. `parameters` may be missing then.
    std::string damage;
};

struct RebuildRequest {
    std::string collection;  ///< empty: all, one after the other
    bool cacheOnly = false;  ///< only reload the stored signatures into the cache
    Parameters parameters;   ///< new ones; only for a named collection
    bool detach = false;     ///< start it and return
};

struct RebuildProgress {
    std::string collection;
    std::uint64_t done = 0;
    std::uint64_t total = 0;
    std::uint64_t failed = 0;  ///< of those done: could not be segmented
    bool finished = false;     ///< with this collection
    double seconds = 0.0;
};

struct BackupReport {
    std::uint64_t bytes = 0;
    std::string sha256;  ///< 32 bytes
};

/// A finished increment.
struct IncrementReport {
    std::uint64_t bytes = 0;         ///< of its file
    std::uint64_t changedBytes = 0;  ///< of the database, in blocks of some pages
    BackupReport backup;             ///< the one that it leads to
};

struct RestoreReport {
    std::uint64_t collections = 0;
    std::uint64_t shapes = 0;
};

struct ImportReport {
    std::string collection;           ///< its name now
    std::uint64_t shapes = 0;         ///< in any state
    std::uint64_t shapesPending = 0;  ///< of these: queued
};

struct CheckProgress {
    std::uint64_t done = 0;
    std::uint64_t total = 0;
    std::vector<std::string> problems;  ///< found since the previous message, one line each
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
    /// Acknowledged changes that were gone when the server started; 0 after a restore.
    std::uint64_t missingCommits = 0;
    std::uint64_t pointBytes = 0;        ///< uncompressed
    std::uint64_t storedPointBytes = 0;  ///< compressed
    double uptimeSeconds = 0.0;
    std::uint64_t searches = 0;  ///< since start
    std::uint64_t ingested = 0;  ///< since start
};

/// The most a request may ask for.
struct Limits {
    std::uint64_t maxPoints = 0;
    std::uint32_t maxK = 0;
    std::uint32_t maxBatch = 0;
    std::uint64_t maxQueuedJobs = 0;
    std::uint64_t maxQueuedBytes = 0;
    std::uint32_t maxChunkBytes = 0;
};

/// One row of the server's table of limits (docs/limits.md).
struct Limit {
    std::string name;         ///< with a dot, the setting that changes it
    std::uint64_t value = 0;  ///< the most that is allowed; the least where the name says min
    std::string unit;
    std::string bounds;   ///< for people: what it bounds
    std::string refusal;  ///< name of the error beyond it; empty: none
};

struct ServerInfo {
    std::string version;
    std::int32_t schemaVersion = 0;  ///< 0: its database is damaged and cannot tell
    Timestamp started;
    Limits limits;
    std::vector<Limit> limitTable;  ///< all of them; empty from a server that is older
    std::uint32_t ingestThreads = 0;
};

/// What an API key allows; each role includes the ones before it.
enum class Role { kReader, kWriter, kAdmin };

/// 0: without limit.
struct KeyLimits {
    std::uint32_t callsPerSecond = 0;
    std::uint64_t scansPerDay = 0;
    std::uint64_t bytesPerDay = 0;  ///< of points received
};

/// A request for a new API key.
struct KeyRequest {
    std::string name;  ///< whose key it is; several may share it
    Role role = Role::kReader;
    std::vector<std::string> collections;  ///< empty: all
    std::optional<Timestamp> expires;      ///< empty: never
    KeyLimits limits;
};

/// An API key without its secret.
struct Key {
    std::string id;
    std::string name;
    Role role = Role::kReader;
    std::vector<std::string> collections;
    KeyLimits limits;
    Timestamp created;
    std::optional<Timestamp> expires;
    std::optional<Timestamp> revoked;
    std::uint64_t scansToday = 0;
    std::uint64_t bytesToday = 0;
};

struct CreatedKey {
    Key key;
    std::string secret;  ///< the whole key; the server cannot tell it again
};

/// The state of a service by grpc.health.v1.
enum class Health { kUnknown, kServing, kNotServing };

}  // namespace shapedb::client
