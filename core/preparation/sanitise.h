// From whatever a client sends to points that geometry can be done on.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Largest magnitude of a coordinate, and smallest half extent of a scan, in scan units:
/// what single precision, the wire format, holds with all its digits.
constexpr double kMaxCoordinate = 3.4e38;
constexpr double kMinHalfExtent = 1.2e-38;

/// Points closer to a common line or plane than this share of the half extent span no volume.
constexpr double kFlatnessTolerance = 1e-6;

/// Coordinates in the unit frame are multiples of this: the last digit of a double near 1. So
/// differences of points are exact, and no product of a few of them leaves the range of a double,
/// however close to each other or to a common plane points lie.
constexpr double kGrid = 0x1p-52;

/// Where the unit frame lies in the scan: scan = centre + unit * p. The unit is a power of
/// two, so scaling a scan by one changes no digit of what follows.
struct Frame {
    Point3 centre;      ///< middle of the axis-aligned bounding box, scan units
    double unit = 1.0;  ///< scan units per unit of the frame, > 0

    Point3 toScan(const Point3& p) const { return centre + unit * p; }
};

struct SanitisedPoints {
    /// Distinct points in the unit frame (|coordinate| <= 1, multiples of kGrid), in
    /// lexicographic order: the order of the input leaves no trace in anything computed from them.
    PointCloud points;
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> index into `points`
    std::uint64_t duplicates = 0;            ///< input points that repeated another (within kGrid)
    Frame frame;
};

/// Checks and normalises a scan. Time O(n log n).
///
/// Errors, each naming the first offending point or the measure: kNonFiniteCoordinate,
/// kCoordinateOutOfRange (a magnitude over kMaxCoordinate, or a half extent under
/// kMinHalfExtent), kTooFewPoints (fewer than 4, or fewer than 4 distinct), kAllPointsEqual,
/// kCollinear, kCoplanar (within kFlatnessTolerance), kOutOfMemory.
[[nodiscard]] Result<SanitisedPoints> sanitise(const PointCloud& scan);

/// The first part of `sanitise`: checks number and coordinates and finds the frame. Errors: those of
/// `sanitise` but for distinctness and flatness.
[[nodiscard]] Result<Frame> frameOf(const PointCloud& scan);

/// The last part: whether points in the unit frame span a volume. Errors: kCollinear, kCoplanar.
[[nodiscard]] Result<void> checkSpansSpace(const PointCloud& points);

struct MergedPoints {
    PointCloud points;                       ///< distinct, in lexicographic order
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> index into `points`
};

/// Merges exact duplicates of finite points and sorts. At most 2^32 - 2 points.
[[nodiscard]] MergedPoints mergeDuplicates(const PointCloud& points);

}  // namespace shapedb
