// SPDX-License-Identifier: GPL-3.0-or-later
// The signature of a shape: its heaviest segments as weighted points (Section 4.1), scaled by the
// shape's bounding box (Section 4.2).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/segmentation/segmentation.h"
#include "core/signature/segment_descriptor.h"
#include "core/signature/statistics.h"

namespace shapedb {

struct SignatureOptions {
    /// How many of the heaviest segments to keep; the paper says "less than ten". 1 to
    /// kMaxSignaturePoints.
    std::uint32_t maxPoints = 7;

    /// Also compute ShapeAttributes. False: points and weights alone, as published.
    bool attributes = false;
};

/// The number of alignments to try grows with the fourth power of the points.
constexpr std::uint32_t kMaxSignaturePoints = 16;

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const SignatureOptions& options);

/// A weighted point, with further measures of its segment. Lengths are divided by Signature::scale. Single
/// precision, so that what is scored is exactly what is stored.
struct WeightedPoint {
    /// Representative point g* relative to the heaviest one's, so (0, 0, 0) for the first.
    std::array<float, 3> position{};
    float weight = 0.0f;         ///< volume of the segment / scale^3, > 0
    float volumeShare = 0.0f;    ///< of the whole interior, (0, 1]
    float maximumRadius = 0.0f;  ///< circumradius of its largest Delaunay ball / scale
    /// Second central moments / scale^2: xx, xy, xz, yy, yz, zz.
    std::array<float, 6> covariance{};
};

/// What the default profile uses beyond points and weights.
struct ShapeAttributes {
    ShapeStatistics statistics{};
    std::uint8_t quality = 255;  ///< Segmentation::quality, in steps of 1/255
    /// Read from a version before 4: statistics of paths (StatisticLayout::ofPaths) are left out of scores.
    bool earlier = false;
    Body body;  ///< bodyOf the signature's points; not persisted
};

struct Signature {
    std::vector<WeightedPoint> points;  ///< in descending order of weight; 1 to kMaxSignaturePoints
    double scale = 1.0;                 ///< smallest diagonal of a box around the interior, scan units, > 0
    Point3 origin;                      ///< heaviest representative point, scan units
    double volume = 0.0;                ///< of the whole interior, scan units cubed
    std::optional<ShapeAttributes> attributes;  ///< with SignatureOptions::attributes
};

/// The share of the whole interior behind a weighted point of this weight, in [0, 1]; 0 only when it is below
/// single precision.
[[nodiscard]] float volumeShareOf(float weight, double scale, double volume) noexcept;

/// True when all numbers that enter a score are equal.
[[nodiscard]] bool sameShape(const Signature& a, const Signature& b) noexcept;

/// Position of point i, scan units.
[[nodiscard]] Point3 pointPosition(const Signature& signature, std::size_t i);
/// Volume of the segment behind point i, scan units cubed.
[[nodiscard]] double pointVolume(const Signature& signature, std::size_t i);
/// Standard deviations of that segment's matter along its principal axes, falling, scan units.
[[nodiscard]] std::array<double, 3> pointExtents(const Signature& signature, std::size_t i);

/// Moves the shape, whose numbers that enter a score stay: adds to every position, scan units.
void moveBy(const Point3& offset, Signature& signature);

/// Errors: kInvalidArgument (options); kNoInterior (no segment heavy enough for single precision);
/// kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<Signature> makeSignature(const Segmentation& segmentation,
                                              const SignatureOptions& options,
                                              const RunContext& context = {});

}  // namespace shapedb
