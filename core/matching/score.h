// SPDX-License-Identifier: GPL-3.0-or-later
// The score of one pair of shapes, and what a user can choose about it. To compare a query with many, make
// its Scorer once (scorer.h).
#pragma once

#include "core/base/error.h"
#include "core/matching/explanation.h"
#include "core/signature/signature.h"

namespace shapedb {

constexpr double kMinKernelWidth = 1e-6;  ///< below, single-precision positions decide by their rounding
constexpr double kMaxKernelWidth = 1e6;   ///< far beyond any shape: weights alone count

struct ScoreOptions {
    /// Also try mirrored alignments. False tells left from right.
    bool reflection = true;
    /// True compares sizes as well: shapes are not scaled to each other.
    bool keepScale = false;
    /// Scores how much of the first shape (the query) the second contains, so that a one-sided scan or
    /// a broken piece finds its whole. Not symmetric. Without keepScale the size of the piece is taken
    /// from the parts that match. Several times slower.
    bool partial = false;
    /// How far apart two points may lie and still match, in units of the shapes' common size: a pair
    /// counts for kernel(d^2, width) of its weight (kernel.h). kMinKernelWidth to kMaxKernelWidth;
    /// smaller is stricter.
    double kernelWidth = 0.1;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const ScoreOptions& options);

// Of the next three: both signatures must be valid (as made by makeSignature or decodeSignature), and so the
// options. a is the query. Thread-safe. docs/scoring.md derives the formulas.

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

// The scale of scores: how a distance between shapes becomes a score in [0, 1].

/// 1 / (1 + (2 D)^2), in (0, 1]: 1 for distance 0, about 0.2 for distance 1, which is typical of unrelated
/// shapes. `distance` is finite, at least 0.
[[nodiscard]] double scoreOfDistance(double distance) noexcept;

/// The inverse, up to rounding; infinite for a score of 0.
[[nodiscard]] double distanceOfScore(double score) noexcept;

}  // namespace shapedb
