// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/body_motion.h"

#include <algorithm>

#include "core/geometry/axis.h"

namespace shapedb {

namespace {

// A point of the body's frame in scan coordinates.
Point3 inScan(const ShapeRow& of, const Point3& inFrame) {
    const Placement& body = *of.placement;
    Point3 p = body.centre;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        p = p +
            coordinate(inFrame, axis) * Point3{body.axes[axis][0], body.axes[axis][1], body.axes[axis][2]};
    }
    return body.origin + of.scale * p;
}

// transposed(to) * rotation * from
Matrix3 betweenFrames(const Matrix3& to, const Matrix3& rotation, const Matrix3& from) {
    Matrix3 result;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            double sum = 0.0;
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    sum += to[i][row] * rotation[i][j] * from[j][column];
                }
            }
            result[row][column] = sum;
        }
    }
    return result;
}

}  // namespace

Motion bodyMotion(const ShapeRow& a, const ShapeRow& b, const Matrix3& rotation, bool reflected,
                  bool keepScale) {
    const Placement& from = *b.placement;
    const Placement& to = *a.placement;
    Motion motion;
    motion.scale = keepScale ? 1.0 : a.scale / b.scale;
    motion.reflected = reflected;
    motion.rotation = betweenFrames(to.axes, rotation, from.axes);
    const Point3 centreA = to.origin + a.scale * to.centre;
    const Point3 centreB = from.origin + b.scale * from.centre;
    motion.translation = centreA - motion.scale * rotate(motion.rotation, centreB);
    return motion;
}

Motion pieceMotion(const ShapeRow& piece, const ShapeRow& whole, const Containment& found, bool keepScale) {
    Motion motion;
    motion.scale = keepScale ? 1.0 : piece.scale / whole.scale / found.scale;
    motion.reflected = found.reflected;
    motion.rotation = betweenFrames(piece.placement->axes, found.rotation, whole.placement->axes);
    motion.translation =
        inScan(piece, found.to) - motion.scale * rotate(motion.rotation, inScan(whole, found.from));
    return motion;
}

void addMatches(const SegmentPairs& pairs, double total, Explanation& explanation) {
    for (std::size_t i = 0; i < pairs.count; ++i) {
        const SegmentPair& pair = pairs.pairs[i];
        explanation.matches.push_back({pair.a, pair.b, pair.gain / total, pair.distance});
    }
    std::sort(explanation.matches.begin(), explanation.matches.end(),
              [](const PointMatch& x, const PointMatch& y) {
                  if (x.share != y.share) return x.share > y.share;
                  return x.a != y.a ? x.a < y.a : x.b < y.b;
              });
}

}  // namespace shapedb
