// SPDX-License-Identifier: GPL-3.0-or-later
// The segments of a signature as the attributed score compares them: in the frame of the whole body,
// with sizes as logarithms.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb {

struct WeightedPoint;

/// One segment as the index keeps it: 12 bytes, all that the attributed score needs.
struct PackedSegmentDescriptor {
    std::array<std::int16_t, 3> position{};  ///< in steps of 1/kPositionSteps
    std::uint16_t share = 1;                 ///< in steps of 1/kShareSteps, at least 1
    std::array<std::uint8_t, 4> size{};      ///< in steps of 1/kSizeSteps octave above kSmallestLength
};

/// Far finer than the noise of any scan.
constexpr double kPositionSteps = 16384.0;
constexpr double kShareSteps = 65535.0;
constexpr double kSizeSteps = 24.0;  // up to 10.6 octaves: sizes are below 1

/// One segment as it is compared. Lengths in units of Signature::scale. All numbers are multiples of the
/// steps of a PackedSegmentDescriptor, so packing loses nothing.
struct SegmentDescriptor {
    std::array<float, 3> position{};  ///< centroid, in the body's frame
    float radius = 0.0f;              ///< distance from the body's centre: length of `position`
    float share = 0.0f;               ///< of the interior's volume, (0, 1]
    /// Base-2 logarithms: the standard deviations of its matter along its principal axes, in descending
    /// order, and the radius of its largest ball. No less than kSmallestLength each.
    std::array<float, 4> size{};
};

/// Smaller lengths count as this: they are below the noise of any scanner.
constexpr double kSmallestLength = 1.0 / 1024.0;

/// Rounds to the nearest steps; numbers out of range are clamped.
[[nodiscard]] PackedSegmentDescriptor packed(const SegmentDescriptor& segment) noexcept;
/// packed(unpacked(p)) == p for a share of at least 1.
[[nodiscard]] SegmentDescriptor unpacked(const PackedSegmentDescriptor& segment) noexcept;

[[nodiscard]] bool operator==(const PackedSegmentDescriptor& a, const PackedSegmentDescriptor& b) noexcept;
[[nodiscard]] bool operator==(const SegmentDescriptor& a, const SegmentDescriptor& b) noexcept;

/// The segments of a signature and their common frame: origin at their centroid, axes along the principal
/// axes of their matter, in descending order of spread, right-handed. Signs of axes, and the order of axes of
/// equal spread, are arbitrary, so a comparison of two bodies must try all.
struct Body {
    std::vector<SegmentDescriptor> segments;  ///< in the order of the points
    Point3 centre;                            ///< in the coordinates of WeightedPoint::position
    Matrix3 axes{};                           ///< rows: the frame's axes in those coordinates
};

/// `points`: at least one, valid, as in a Signature. Deterministic.
[[nodiscard]] Body bodyOf(const std::vector<WeightedPoint>& points);
/// The same, into an existing body whose memory is reused.
void setBody(const std::vector<WeightedPoint>& points, Body& body);

}  // namespace shapedb
