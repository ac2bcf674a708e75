// SPDX-License-Identifier: GPL-3.0-or-later
// How much of one body another one contains, for a one-sided scan or a broken piece as the query.
#pragma once

#include "core/matching/attributed/segment_match.h"
#include "core/matching/attributed/segment_span.h"
#include "core/matching/score.h"

namespace shapedb {

/// Where a piece lies in the whole: x in the whole's frame goes to
///   rotation * (x - from) / scale + to
/// in the piece's frame.
struct Containment {
    double share = 0.0;  ///< of the piece's volume that has a counterpart in the whole, [0, 1]
    Matrix3 rotation = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< whole to piece
    bool reflected = false;
    double scale = 1.0;  ///< a length 1 of the piece (its own units) is this long in the whole's
    Point3 from;         ///< in the whole's frame
    Point3 to;           ///< in the piece's frame
};

/// The best of all alignments that put one of the heaviest segments of `piece` on a segment of `whole`,
/// a second one in the direction of a second and a third to its side. Each segment of the piece counts
/// its volume times the likeness of sizes and the kernel of the distance to its best counterpart.
/// `knownScale` > 0 fixes the scale (sizes kept); 0 takes it from the segments that are put on each
/// other. Not symmetric. `options`: reflection, kernelWidth. Costs about six times SegmentComparison.
[[nodiscard]] Containment containment(SegmentSpan piece, SegmentSpan whole, double knownScale,
                                      const ScoreOptions& options);

/// Never below containment(...).share.
[[nodiscard]] double containmentBound(SegmentSpan piece, SegmentSpan whole, double knownScale);

/// Which segment of the piece (a) lies on which of the whole (b); the gains sum to the share. Distances
/// in the piece's units.
[[nodiscard]] SegmentPairs containedPairs(SegmentSpan piece, SegmentSpan whole, const Containment& found,
                                          const ScoreOptions& options);

}  // namespace shapedb
