// The signature of a shape: its heaviest segments as weighted points (Section 4.1),
// scaled by the shape's bounding box (Section 4.2).
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
    /// Heaviest segments kept. The paper: "less than ten". 1 to kMaxSignaturePoints.
    std::uint32_t maxPoints = 7;

    /// Also keep what the shape says as a whole (ShapeAttributes). False: points and weights
    /// alone, as published.
    bool attributes = false;
};

/// Alignments grow with the fourth power of the points.
constexpr std::uint32_t kMaxSignaturePoints = 16;

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const SignatureOptions& options);

/// One weighted point with what its segment knows besides. Lengths are divided by
/// Signature::scale. Single precision: what is scored is exactly what is stored.
struct WeightedPoint {
    /// Representative point g* minus the heaviest one's: the first point's is (0, 0, 0).
    std::array<float, 3> position{};
    float weight = 0.0f;         ///< volume of the segment / scale^3, > 0
    float volumeShare = 0.0f;    ///< of the whole interior, (0, 1]
    float maximumRadius = 0.0f;  ///< circumradius of its largest Delaunay ball / scale
    /// Second central moments / scale^2: xx, xy, xz, yy, yz, zz.
    std::array<float, 6> covariance{};
};

/// What the default profile knows of a shape beyond points and weights.
struct ShapeAttributes {
    ShapeStatistics statistics{};
    std::uint8_t quality = 255;  ///< of the interior, in steps of 1/255: Segmentation::quality
    Body body;                   ///< of the signature's points; not persisted: `bodyOf`
};

struct Signature {
    std::vector<WeightedPoint> points;  ///< by falling weight; 1 to kMaxSignaturePoints
    double scale = 1.0;                 ///< smallest diagonal of a box around the interior, scan units, > 0
    Point3 origin;                      ///< heaviest representative point, scan units
    double volume = 0.0;                ///< of the whole interior, scan units cubed
    std::optional<ShapeAttributes> attributes;  ///< with SignatureOptions::attributes
};

/// The share of the whole interior that a weighted point of this weight stands for: in [0, 1], 0 only when
/// it is below single precision.
[[nodiscard]] float volumeShareOf(float weight, double scale, double volume) noexcept;

/// True when all numbers that enter a score are the same, bit for bit.
[[nodiscard]] bool sameShape(const Signature& a, const Signature& b) noexcept;

/// Scan units: position of point i of the signature.
[[nodiscard]] Point3 pointPosition(const Signature& signature, std::size_t i);
/// Scan units cubed: volume of the segment behind point i.
[[nodiscard]] double pointVolume(const Signature& signature, std::size_t i);
/// Scan units: standard deviations of the segment's matter along its principal axes, falling.
[[nodiscard]] std::array<double, 3> pointExtents(const Signature& signature, std::size_t i);

/// Errors: kInvalidArgument (options); kNoInterior (no segment heavy enough for single precision);
/// kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<Signature> makeSignature(const Segmentation& segmentation,
                                              const SignatureOptions& options,
                                              const RunContext& context = {});

}  // namespace shapedb
