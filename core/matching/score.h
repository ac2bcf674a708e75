// How alike two signatures are: Section 4.2 of the paper. The score is the best over all
// alignments of the two weighted point sets; signatures with attributes (the default profile) also
// compare what the segments and the shapes as a whole are like (attribute_score.h).
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/motion.h"
#include "core/signature/signature.h"

namespace shapedb {

constexpr double kMinKernelWidth = 1e-6;  ///< below, single-precision positions decide by their rounding
constexpr double kMaxKernelWidth = 1e6;   ///< far beyond any shape: weights alone count

struct ScoreOptions {
    /// Try mirrored alignments too. False tells left from right.
    bool reflection = true;
    /// True compares sizes as well: shapes are not scaled to each other.
    bool keepScale = false;
    /// Asks how much of the first shape (the query) the second contains: a one-sided scan or a
    /// broken piece finds its whole. Not symmetric, and without keepScale the piece's size is taken
    /// from the parts that match. Slower by several times.
    bool partial = false;
    /// How far apart two points may lie and still count as the same part, in units of the shapes'
    /// common size: a pair at distance d counts for kernel(d) = (1 - d^2 / (8 width^2))^4 of its
    /// weight (0 beyond 2.83 widths), close to a Gaussian of this standard deviation.
    /// kMinKernelWidth to kMaxKernelWidth. Smaller: stricter.
    double kernelWidth = 0.1;
};

/// The most a signature with a single point scores against another: see `score`.
constexpr double kDegenerateCeiling = 0.9;

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const ScoreOptions& options);

/// For two signatures with attributes: 1 / (1 + (2 D)^2) in (0, 1], where D is the mean of
/// distances, each in units of what two unrelated shapes typically differ by: the statistics and
/// the parts under their best alignment (attribute_score.h, part_match.h). Two unrelated shapes
/// score about 0.2, two scans of one object above 0.9. Below 1 unless `sameShape(a, b)` (with
/// keepScale also of the same scale); symmetric bit for bit.
///
/// Otherwise, points and weights alone, as published. Score of the best alignment: similarity / (similarity +
/// dissimilarity) in [0, 1], where the similarity is the sum over matched pairs (one to one) of min(weights)
/// * kernel(distance), and the dissimilarity is the weight of either side that this leaves over. 1 when
/// `sameShape(a, b)` (with keepScale also of the same scale); symmetric bit for bit. When one signature has a
/// single point and they are not the same, the score is at most kDegenerateCeiling: one weighted
/// point leaves the rotation open and says too little.
///
/// Partial, with attributes: D and, by up to a half, what of `a` finds no like in `b` (containment.h);
/// otherwise similarity / weight of `a`. Not symmetric; 1 still only for the same shape.
///
/// Both must be valid (as made by makeSignature or decodeSignature), the options valid.
/// Thread-safe, allocates nothing.
[[nodiscard]] double score(const Signature& a, const Signature& b, const ScoreOptions& options);

/// Never below `score` of the same arguments, and cheaper by the number of alignments (of two
/// signatures with attributes everything but the alignment is exact):
/// a motion keeps distances from the anchor, so each point can at best meet a point of the
/// other at its own distance from the anchor.
[[nodiscard]] double scoreUpperBound(const Signature& a, const Signature& b, const ScoreOptions& options);

/// One of the distances that make up a score of signatures with attributes.
struct ScoreTerm {
    const char* name = "";  ///< static storage: "chords", "parts", ...
    double distance = 0.0;  ///< >= 0; 1: as two unrelated shapes typically differ
    double weight = 0.0;    ///< in the mean; all terms' sum to 1
};

struct PointMatch {
    std::uint32_t a = 0;    ///< index into a.points
    std::uint32_t b = 0;    ///< index into b.points
    double share = 0.0;     ///< of the similarity, (0, 1]; all matches sum to 1
    double distance = 0.0;  ///< between the two after the motion, in units of a's scale
};

/// The alignment that achieves the score, and what it lays on what.
struct Explanation {
    double score = 0.0;  ///< as `score`
    /// With attributes: the parts' agreement and what it lacks to 1. Otherwise: matched weight, each pair
    /// discounted by its distance; in cubes of the common unit: each signature's own scale, or with keepScale
    /// the larger of the two.
    double similarity = 0.0;
    double dissimilarity = 0.0;       ///< weight of either side that found no match; same unit
    Motion motion;                    ///< scan coordinates of b to scan coordinates of a
    std::vector<PointMatch> matches;  ///< by falling share; with attributes a point may occur twice
    std::vector<ScoreTerm> terms;     ///< with attributes: what the score is made of
    std::vector<std::uint32_t> unmatchedA;
    std::vector<std::uint32_t> unmatchedB;
    bool degenerate = false;  ///< a single-point signature left the rotation open
};

/// As `score`, with its reasons. `explain(a, b).score == score(a, b)`, bit for bit.
[[nodiscard]] Explanation explain(const Signature& a, const Signature& b, const ScoreOptions& options);

}  // namespace shapedb
