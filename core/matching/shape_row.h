// SPDX-License-Identifier: GPL-3.0-or-later
// What is scored of a shape, and nothing else, in the packed form in which a search keeps it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/geometry/motion.h"
#include "core/geometry/point.h"
#include "core/matching/attributed/packed_statistics.h"
#include "core/signature/signature.h"

namespace shapedb {

/// A weighted point as published.
struct PackedPoint {
    std::array<float, 3> position{};
    float weight = 0.0f;
};

/// Where a shape lies in its scan. Enters no score, but the motion of an explanation.
struct Placement {
    Point3 origin;  ///< Signature::origin
    // Of attributed shapes the frame of the body (Body).
    Point3 centre;
    Matrix3 axes{};
};

/// The scored numbers of one shape: a view, to be copied freely while its owner lives. An attributed
/// shape has segments, statistics and a quality. The rows of a search leave out what no score reads: the
/// points of attributed shapes and all placements. A PackedShape has both.
struct ShapeRow {
    double scale = 1.0;
    const PackedPoint* points = nullptr;
    std::size_t pointCount = 0;
    const PackedSegmentDescriptor* segments = nullptr;
    std::size_t segmentCount = 0;
    const HalfRow* firstHalf = nullptr;   ///< of the statistics; null without attributes
    const HalfRow* secondHalf = nullptr;  ///< likewise
    std::uint8_t quality = 0;             ///< of the interior, in steps of 1/255
    bool earlier = false;                 ///< ShapeAttributes::earlier
    const Placement* placement = nullptr;

    [[nodiscard]] bool attributed() const { return segmentCount > 0; }
};

/// The scored numbers of many shapes, each kind in an array of its own: a view, as above.
struct ShapeRows {
    std::size_t count = 0;
    std::size_t attributedCount = 0;
    const double* scales = nullptr;
    const std::uint8_t* qualities = nullptr;
    const std::uint8_t* earlier = nullptr;  ///< 1: ShapeAttributes::earlier
    /// Statistics of all rows (zero where not attributed); null when no row is attributed.
    const HalfRow* firstHalves = nullptr;
    const HalfRow* secondHalves = nullptr;
    const PackedSegmentDescriptor* segments = nullptr;
    const std::uint16_t* segmentsEnd =
        nullptr;  ///< of each row, in `segments`; it begins where the last ends
    const PackedPoint* points = nullptr;
    const std::uint16_t* pointsEnd = nullptr;  ///< likewise, in `points`

    [[nodiscard]] bool attributed(std::size_t row) const {
        return segmentsEnd[row] > beginOf(segmentsEnd, row);
    }
    [[nodiscard]] ShapeRow operator[](std::size_t row) const;

  private:
    static std::size_t beginOf(const std::uint16_t* ends, std::size_t row) {
        return row == 0 ? 0 : ends[row - 1];
    }
};

/// The scored numbers of one signature, packed without loss, and its placement. Holds all of it inline: no
/// allocation.
class PackedShape {
  public:
    /// `signature` valid: as made by makeSignature or decodeSignature.
    explicit PackedShape(const Signature& signature);

    /// Valid while this object lives and does not move.
    [[nodiscard]] ShapeRow row() const;

  private:
    double scale_;
    std::size_t pointCount_ = 0;
    std::size_t segmentCount_ = 0;
    std::uint8_t quality_ = 0;
    bool earlier_ = false;
    Placement placement_;
    HalfRow firstHalf_, secondHalf_;
    std::array<PackedPoint, kMaxSignaturePoints> points_;
    std::array<PackedSegmentDescriptor, kMaxSignaturePoints> segments_;
};

/// Whether all numbers that enter a score are the same; with `keepScale` the scale is one of them.
/// As sameShape(Signature, Signature).
[[nodiscard]] bool sameShape(const ShapeRow& a, const ShapeRow& b, bool keepScale = false);

/// An order on what is scored. A symmetric scorer puts the lesser shape first, so that the score of
/// (a, b) and of (b, a) is one computation and has the same bits.
[[nodiscard]] bool canonicalLess(const ShapeRow& a, const ShapeRow& b);

}  // namespace shapedb
