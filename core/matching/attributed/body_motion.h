// SPDX-License-Identifier: GPL-3.0-or-later
// From alignments of bodies, in their own frames, to what an explanation shows: motions of scans.
#pragma once

#include "core/matching/attributed/containment.h"
#include "core/matching/attributed/segment_match.h"
#include "core/matching/explanation.h"
#include "core/matching/shape_row.h"

namespace shapedb {

// All shapes with their placement.

/// Scan coordinates of b to scan coordinates of a, from a rotation of the frame of b to that of a.
/// With `keepScale` the scale is 1.
[[nodiscard]] Motion bodyMotion(const ShapeRow& a, const ShapeRow& b, const Matrix3& rotation, bool reflected,
                                bool keepScale);

/// Scan coordinates of the whole to scan coordinates of the piece.
[[nodiscard]] Motion pieceMotion(const ShapeRow& piece, const ShapeRow& whole, const Containment& found,
                                 bool keepScale);

/// Adds the pairs in descending order of share of `total`, the sum of their gains.
void addMatches(const SegmentPairs& pairs, double total, Explanation& explanation);

}  // namespace shapedb
