// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/shape_row.h"

#include <algorithm>

namespace shapedb {

namespace {

ShapeStatistics statisticsOf(const ShapeRow& shape) {
    ShapeStatistics levels;
    unpackStatistics(*shape.firstHalf, *shape.secondHalf, levels);
    return levels;
}

// Packed numbers are in the order of the numbers they stand for.
bool canonicalLessAttributed(const ShapeRow& a, const ShapeRow& b) {
    if (a.segmentCount != b.segmentCount) return a.segmentCount < b.segmentCount;
    for (std::size_t i = 0; i < a.segmentCount; ++i) {
        const PackedSegmentDescriptor& p = a.segments[i];
        const PackedSegmentDescriptor& q = b.segments[i];
        if (p.share != q.share) return p.share < q.share;
        if (p.position != q.position) return p.position < q.position;
        if (p.size != q.size) return p.size < q.size;
    }
    if (a.quality != b.quality) return a.quality < b.quality;
    if (a.earlier != b.earlier) return b.earlier;
    // By the levels, not the packed bytes: the order must not depend on how they are packed.
    return statisticsOf(a) < statisticsOf(b);
}

}  // namespace

ShapeRow ShapeRows::operator[](std::size_t row) const {
    ShapeRow shape;
    shape.scale = scales[row];
    shape.quality = qualities[row];
    shape.earlier = earlier[row] != 0;
    shape.points = points + beginOf(pointsEnd, row);
    shape.pointCount = pointsEnd[row] - beginOf(pointsEnd, row);
    shape.segments = segments + beginOf(segmentsEnd, row);
    shape.segmentCount = segmentsEnd[row] - beginOf(segmentsEnd, row);
    if (shape.segmentCount > 0) {
        shape.firstHalf = firstHalves + row;
        shape.secondHalf = secondHalves + row;
    }
    return shape;
}

PackedShape::PackedShape(const Signature& signature)
    : scale_(signature.scale), pointCount_(signature.points.size()) {
    for (std::size_t i = 0; i < pointCount_; ++i) {
        points_[i] = {signature.points[i].position, signature.points[i].weight};
    }
    placement_.origin = signature.origin;
    if (!signature.attributes) return;
    const Body& body = signature.attributes->body;
    placement_.centre = body.centre;
    placement_.axes = body.axes;
    const auto& segments = body.segments;
    segmentCount_ = segments.size();
    for (std::size_t i = 0; i < segmentCount_; ++i) segments_[i] = packed(segments[i]);
    packStatistics(signature.attributes->statistics, firstHalf_, secondHalf_);
    quality_ = signature.attributes->quality;
    earlier_ = signature.attributes->earlier;
}

ShapeRow PackedShape::row() const {
    ShapeRow shape;
    shape.scale = scale_;
    shape.points = points_.data();
    shape.pointCount = pointCount_;
    shape.placement = &placement_;
    if (segmentCount_ == 0) return shape;
    shape.segments = segments_.data();
    shape.segmentCount = segmentCount_;
    shape.firstHalf = &firstHalf_;
    shape.secondHalf = &secondHalf_;
    shape.quality = quality_;
    shape.earlier = earlier_;
    return shape;
}

bool sameShape(const ShapeRow& a, const ShapeRow& b, bool keepScale) {
    if (keepScale && a.scale != b.scale) return false;
    if (a.attributed() != b.attributed()) return false;
    if (a.attributed()) {
        return a.quality == b.quality && a.earlier == b.earlier && a.firstHalf->bytes == b.firstHalf->bytes &&
               a.secondHalf->bytes == b.secondHalf->bytes &&
               std::equal(a.segments, a.segments + a.segmentCount, b.segments, b.segments + b.segmentCount);
    }
    return std::equal(a.points, a.points + a.pointCount, b.points, b.points + b.pointCount,
                      [](const PackedPoint& p, const PackedPoint& q) {
                          return p.position == q.position && p.weight == q.weight;
                      });
}

bool canonicalLess(const ShapeRow& a, const ShapeRow& b) {
    if (a.attributed() && b.attributed()) return canonicalLessAttributed(a, b);
    if (a.pointCount != b.pointCount) return a.pointCount < b.pointCount;
    for (std::size_t i = 0; i < a.pointCount; ++i) {
        const PackedPoint& p = a.points[i];
        const PackedPoint& q = b.points[i];
        if (p.weight != q.weight) return p.weight < q.weight;
        if (p.position != q.position) return p.position < q.position;
    }
    return a.scale < b.scale;
}

}  // namespace shapedb
