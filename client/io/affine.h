// SPDX-License-Identifier: Apache-2.0
// Where a scene puts the parts that it is made of. Private to client/io.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "core/geometry/point.h"

namespace shapedb::io {

/// p -> rows * p + shift.
struct Affine {
    std::array<Point3, 3> rows = {Point3{1, 0, 0}, Point3{0, 1, 0}, Point3{0, 0, 1}};
    Point3 shift;

    Point3 operator()(const Point3& p) const {
        return Point3{dot(rows[0], p), dot(rows[1], p), dot(rows[2], p)} + shift;
    }
};

/// First the second, then the first.
inline Affine operator*(const Affine& a, const Affine& b) {
    Affine both;
    for (std::size_t i = 0; i < 3; ++i) {
        const Point3& row = a.rows[i];
        both.rows[i] = row.x * b.rows[0] + row.y * b.rows[1] + row.z * b.rows[2];
    }
    both.shift = a(b.shift);
    return both;
}

/// A few bytes of a scene can place a part again, and a part of parts again: more vertices than a file of
/// this many bytes is meant to have, and than 32 bits number.
inline bool tooManyCopies(std::uint64_t vertices, std::uint64_t bytes) {
    constexpr std::uint64_t kAlwaysAllowed = 1'000'000;
    return vertices > std::numeric_limits<std::uint32_t>::max() ||
           (vertices > kAlwaysAllowed && vertices / 100 > bytes);
}

}  // namespace shapedb::io
