// SPDX-License-Identifier: GPL-3.0-or-later
// The segments of a body as they are compared, wherever they are kept.
#pragma once

#include <array>
#include <cstddef>

#include "core/matching/shape_row.h"

namespace shapedb {

/// Segments on the stack.
class SegmentArray {
  public:
    explicit SegmentArray(const ShapeRow& shape) : count_(shape.segmentCount) {
        for (std::size_t i = 0; i < count_; ++i) segments_[i] = unpacked(shape.segments[i]);
    }

    [[nodiscard]] const SegmentDescriptor* data() const { return segments_.data(); }
    [[nodiscard]] std::size_t size() const { return count_; }

  private:
    std::array<SegmentDescriptor, kMaxSignaturePoints> segments_;
    std::size_t count_;
};

/// A view; implicit, so that every owner of segments can be passed as one.
class SegmentSpan {
  public:
    SegmentSpan(const SegmentArray& segments) : data_(segments.data()), size_(segments.size()) {}
    SegmentSpan(const Body& body) : data_(body.segments.data()), size_(body.segments.size()) {}

    [[nodiscard]] std::size_t size() const { return size_; }
    const SegmentDescriptor& operator[](std::size_t i) const { return data_[i]; }
    [[nodiscard]] const SegmentDescriptor* begin() const { return data_; }
    [[nodiscard]] const SegmentDescriptor* end() const { return data_ + size_; }

  private:
    const SegmentDescriptor* data_;
    std::size_t size_;
};

}  // namespace shapedb
