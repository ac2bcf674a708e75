// SPDX-License-Identifier: GPL-3.0-or-later
// A query with attributes, prepared to be compared with many shapes.
#pragma once

#include "core/matching/attributed/attribute_distance.h"
#include "core/matching/attributed/packed_statistics.h"
#include "core/matching/attributed/segment_span.h"
#include "core/matching/shape_row.h"

namespace shapedb {

/// The sums of both halves, by Statistic.
[[nodiscard]] inline LevelSums joined(const HalfSums& first, const HalfSums& second) {
    LevelSums sums;
    for (std::size_t s = 0; s < kKindsPerHalf; ++s) {
        sums[static_cast<std::size_t>(kFirstHalf[s])] = static_cast<std::uint16_t>(first[s]);
    }
    for (std::size_t s = 0; s < kKindsInSecondHalf; ++s) {
        sums[static_cast<std::size_t>(kSecondHalf[s])] = static_cast<std::uint16_t>(second[s]);
    }
    return sums;
}

[[nodiscard]] inline Grounds groundsOf(const ShapeRow& shape) { return {shape.quality, shape.earlier}; }

/// Immutable, thread-safe.
class AttributedQuery {
  public:
    explicit AttributedQuery(const Signature& signature)
        : packed_(signature),
          segments_(packed_.row()),
          difference_(*packed_.row().firstHalf, *packed_.row().secondHalf) {}

    /// With points and placement.
    [[nodiscard]] ShapeRow row() const { return packed_.row(); }
    [[nodiscard]] const SegmentArray& segments() const { return segments_; }
    [[nodiscard]] Grounds grounds() const { return groundsOf(packed_.row()); }
    [[nodiscard]] double scale() const { return packed_.row().scale; }
    [[nodiscard]] const StatisticsDifference& difference() const { return difference_; }

    /// `shape` must be attributed.
    [[nodiscard]] LevelSums levelSums(const ShapeRow& shape) const {
        HalfSums first;
        difference_.first(shape.firstHalf, 1, &first);
        return joined(first, difference_.second(*shape.secondHalf));
    }

  private:
    PackedShape packed_;
    SegmentArray segments_;
    StatisticsDifference difference_;
};

}  // namespace shapedb
