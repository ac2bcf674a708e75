// The score of signatures with attributes: what the parts of two shapes, and the shapes as a
// whole, differ by, as one distance. docs/scoring.md derives it.
#pragma once

#include <array>
#include <cstdint>

#include "core/matching/attributed/segment_match.h"
#include "core/matching/score.h"
#include "core/signature/signature.h"

namespace shapedb {

/// Distances of the statistics and of the parts, each in units of what two unrelated shapes
/// typically differ by, are averaged with these weights. How far the poorer of both interiors can be
/// trusted decides: what rests on it then counts for all or for nearly nothing, the outline the more.
struct AttributeDistance {
    double statistics = 0.0;  ///< weighted sum over the statistics
    double partsWeight = 0.0;
    double totalWeight = 0.0;      ///< with the parts'
    double scale = 0.0;            ///< with keepScale: octaves between the sizes, else 0
    double containedWeight = 0.0;  ///< of a piece: what is contained, against all of the above, [0, 1]
};

/// Both with attributes. Everything but the parts; exact and quick: sums of byte differences.
[[nodiscard]] AttributeDistance attributeDistance(const Signature& a, const Signature& b,
                                                  const ScoreOptions& options);

/// 1 / (1 + (2 D)^2), D the mean of the distances where the parts agree by `agreement`: falls as
/// the agreement falls, in (0, 1]. Unrelated shapes (D = 1) typically score 0.2.
[[nodiscard]] double attributeScore(const AttributeDistance& distance, double agreement);

/// For a piece and its whole: D as above (without the sizes' difference), for a piece still resembles
/// its whole, and by up to a half the share of the piece that the whole contains. Falls as either does.
[[nodiscard]] double pieceScore(const AttributeDistance& distance, double agreement, double share);

/// What a level of difference in each statistic adds to the mean distance D of two shapes whose
/// interiors have these qualities, and what the rest may add: for bounds of many candidates.
struct LevelWeights {
    std::array<double, kStatisticKinds> perLevel{};  ///< of D
    double partial = 1.0;  ///< of a piece: how much of D is left beside what is contained
};
[[nodiscard]] LevelWeights levelWeights(std::uint8_t qualityA, std::uint8_t qualityB);

/// The largest mean distance with which a score of at least `score` (in [0, 1]) can be had, a little
/// more for rounding; infinite for 0.
[[nodiscard]] double maxDistanceForScore(double score);

/// No score of shapes at this mean distance or farther is larger; a little more for rounding.
[[nodiscard]] double scoreAt(double distance);

/// How many octaves lie between two sizes: what keepScale adds, across to the mean distance.
[[nodiscard]] double octavesBetween(double scaleA, double scaleB);

/// Name, distance and weight of every term, in a fixed order; the weights sum to 1.
[[nodiscard]] std::vector<ScoreTerm> scoreTerms(const Signature& a, const Signature& b,
                                                const ScoreOptions& options, double agreement);

/// The same of a piece: with the term of what the whole contains of it.
[[nodiscard]] std::vector<ScoreTerm> pieceTerms(const Signature& a, const Signature& b,
                                                const ScoreOptions& options, double agreement, double share);

}  // namespace shapedb
