// A query with attributes, prepared to be compared with many shapes.
#pragma once

#include "core/matching/attributed/attribute_distance.h"
#include "core/matching/attributed/packed_statistics.h"
#include "core/matching/attributed/segment_span.h"
#include "core/matching/shape_row.h"

namespace shapedb {

/// Immutable, thread-safe.
class AttributedQuery {
  public:
    explicit AttributedQuery(const Signature& signature)
        : signature_(signature),
          packed_(signature),
          segments_(packed_.row()),
          difference_(signature.attributes->statistics) {}

    [[nodiscard]] const Signature& signature() const { return signature_; }
    [[nodiscard]] ShapeRow row() const { return packed_.row(); }
    [[nodiscard]] const SegmentArray& segments() const { return segments_; }
    [[nodiscard]] std::uint8_t quality() const { return signature_.attributes->quality; }
    [[nodiscard]] const StatisticsDifference& difference() const { return difference_; }

    /// Of an attributed shape.
    [[nodiscard]] LevelSums levelSums(const ShapeRow& shape) const;

  private:
    Signature signature_;
    PackedShape packed_;
    SegmentArray segments_;
    StatisticsDifference difference_;
};

/// The sums of both halves by Statistic.
[[nodiscard]] LevelSums joined(const HalfSums& first, const HalfSums& second);

}  // namespace shapedb
