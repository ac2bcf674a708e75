// Scans in the form in which they travel: packed little-endian float32.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::client {

/// Bytes of one point on the wire.
constexpr std::size_t kPointBytes = 12;
/// Bytes of one chunk: the most whole points that fit into 1 MiB.
constexpr std::size_t kChunkBytes = (std::size_t{1} << 20) / kPointBytes * kPointBytes;

/// A coordinate beyond this many box diagonals from 0 is rounded by more than 2^-20 (a
/// millionth) of the diagonal: a float32 has 24 significant bits, and 24 = 20 + log2(16).
constexpr double kFarFromOrigin = 16.0;

struct PackedPoints {
    std::string bytes;  ///< kPointBytes * count
    std::uint64_t count = 0;
    std::string sha256;  ///< 32 bytes, of `bytes`
    Point3 offset;       ///< what was taken off every point, scan units
};

/// Errors: kTooFewPoints (none), kNonFiniteCoordinate, kCoordinateOutOfRange (beyond the largest
/// float32, or the whole scan smaller than the smallest ones that keep their precision); both
/// name the first such point.
[[nodiscard]] Result<PackedPoints> packPoints(const PointCloud& points);

/// Appends the points in `bytes` to `points`. Errors: kMalformedStream when the length is not a
/// multiple of kPointBytes.
[[nodiscard]] Result<void> unpackPoints(const std::string& bytes, PointCloud& points);

/// "12 0.5 -3", precise enough to give the same doubles again.
[[nodiscard]] std::string offsetText(const Point3& offset);

}  // namespace shapedb::client
