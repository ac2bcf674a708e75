// SPDX-License-Identifier: GPL-3.0-or-later
// The score of one pair of shapes. To compare a query with many, make its Scorer once (scorer.h).
#pragma once

#include "core/matching/explanation.h"
#include "core/matching/score_options.h"
#include "core/signature/signature.h"

namespace shapedb {

// Both signatures must be valid (as made by makeSignature or decodeSignature), and so the options. a
// is the query. Thread-safe. docs/scoring.md derives the formulas.

/// How alike two shapes are, in [0, 1].
///
/// Both with attributes: 1 / (1 + (2 D)^2) in (0, 1], where D is the mean distance of the statistics
/// and of the parts under their best alignment, in units of what unrelated shapes typically differ by
/// (attributed/attribute_distance.h). Unrelated shapes score about 0.2, two scans of one object above
/// 0.9. Below 1 unless `sameShape(a, b)` (with keepScale also of the same scale).
///
/// Otherwise points and weights, as published: similarity / (similarity + dissimilarity) of the best
/// alignment, where the similarity is the sum over pairs matched one to one of min(weights) * kernel,
/// and the dissimilarity the weight of either side that is left over. When either has a single point
/// and they are not the same, at most kDegenerateCeiling (published/published_scorer.h).
///
/// Partial, with attributes: from D and, by up to a half, the share of `a` that `b` does not contain
/// (attributed/containment.h); otherwise similarity / weight of `a`. 1 still only for the same shape.
///
/// Symmetric bit for bit unless partial.
[[nodiscard]] double score(const Signature& a, const Signature& b, const ScoreOptions& options);

/// Never below `score` of the same arguments, and cheaper. With attributes everything but the alignment is
/// exact.
[[nodiscard]] double scoreUpperBound(const Signature& a, const Signature& b, const ScoreOptions& options);

/// `score` with its reasons; the same bits.
[[nodiscard]] Explanation explain(const Signature& a, const Signature& b, const ScoreOptions& options);

}  // namespace shapedb
