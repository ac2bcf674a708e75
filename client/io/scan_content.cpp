// SPDX-License-Identifier: Apache-2.0
#include "client/io/scan_content.h"

#include <algorithm>

#include "core/base/count_text.h"

namespace shapedb::io {

namespace {

// Triangles with a repeated vertex stitch strips together; they have no area.
void addTriangle(std::vector<Triangle>& triangles, const Triangle& t) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
}

}  // namespace

Error VertexSink::refusal(const Point3& p, const std::string& where) const {
    const std::string place = file_->path() + ": " + where + ": ";
    if (!isFinite(p)) {
        return {ErrorCode::kNonFiniteCoordinate, place + "vertex " + std::to_string(vertices_->size()) +
                                                     " has a coordinate that is NaN or infinite; remove the "
                                                     "vertex"};
    }
    return {ErrorCode::kPointLimitExceeded, place + "the file has more than " +
                                                countText(maxPoints_, "point") +
                                                ", which is the limit; remove some or raise "
                                                "the limit"};
}

void VertexSink::reserve(std::uint64_t count) {
    vertices_->reserve(static_cast<std::size_t>(std::min<std::uint64_t>(count, maxPoints_)));
}

void PolygonFan::add(std::uint32_t vertex) {
    if (corners_ == 0) first_ = vertex;
    if (corners_ >= 2) addTriangle(*triangles_, {first_, previous_, vertex});
    previous_ = vertex;
    ++corners_;
}

void TriangleStrip::add(std::uint32_t vertex) {
    if (corners_ >= 2) {
        // Every second triangle of a strip is wound the other way.
        const bool swapped = corners_ % 2 == 1;
        addTriangle(*triangles_, {last_[swapped ? 1 : 0], last_[swapped ? 0 : 1], vertex});
    }
    last_ = {last_[1], vertex};
    ++corners_;
}

}  // namespace shapedb::io
