// SPDX-License-Identifier: GPL-3.0-or-later
// The distance behind the score of signatures with attributes: what the segments of two shapes, and the
// shapes as a whole, differ by, as one number. docs/scoring.md derives it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/matching/explanation.h"
#include "core/signature/statistics.h"

namespace shapedb {

/// The L1 distance of each statistic of two shapes, in levels (steps of the square root of a share); of
/// a reversible statistic the smaller of both orders. By Statistic.
using LevelSums = std::array<std::uint16_t, kStatisticKinds>;

/// What two unrelated shapes typically differ by: root distances of the statistics by Statistic, then one
/// less the agreement of the parts. `shapedb-bench typical` measures them.
[[nodiscard]] std::array<double, kStatisticKinds + 1> typicalDifferences() noexcept;

/// What the mean distance D of two shapes is made of. Each term is in units of what unrelated shapes
/// typically differ by. The weights depend on the worse of the two interiors: the less reliable it is,
/// the less what rests on it counts, and the more the outline does.
struct AttributeDistance {
    double statistics = 0.0;  ///< weighted sum over the statistics
    double partsWeight = 0.0;
    double totalWeight = 0.0;      ///< with the parts'
    double scale = 0.0;            ///< with keepScale: octaves between the sizes, else 0
    double containedWeight = 0.0;  ///< partial: of the contained parts against all of the above, [0, 1]
};

/// The properties of a shape that decide how much each statistic counts.
struct Grounds {
    Grounds(std::uint8_t ofInterior, bool ofEarlier = false) : quality(ofInterior), earlier(ofEarlier) {}

    std::uint8_t quality;  ///< of the interior, 0 to 255
    bool earlier;          ///< ShapeAttributes::earlier: statistics of paths count for nothing
};

/// AttributeDistance::statistics of two shapes with these grounds.
[[nodiscard]] double statisticsDistance(const LevelSums& sums, Grounds a, Grounds b);

/// Everything but the parts. `octaves`: what goes into `scale`.
[[nodiscard]] AttributeDistance attributeDistance(double statistics, Grounds a, Grounds b, double octaves);

/// 1 / (1 + (2 D)^2), in (0, 1], where the parts agree by `agreement` and D is the mean of all
/// distances. Rises with the agreement. Unrelated shapes (D = 1) typically score 0.2.
[[nodiscard]] double attributeScore(const AttributeDistance& distance, double agreement);

/// The score of a piece in its whole, from D as above (without the difference of sizes), since a piece still
/// resembles its whole, and, for up to half of it, from the share of the piece that the whole does not
/// contain.
[[nodiscard]] double partialScore(const AttributeDistance& distance, double agreement, double share);

/// For bounds of many candidates: what one level of difference in each statistic adds to D, of shapes with
/// these grounds.
struct LevelWeights {
    std::array<double, kStatisticKinds> perLevel{};
    double partial = 1.0;  ///< partial: the weight of D beside the contained parts
};
[[nodiscard]] LevelWeights levelWeights(Grounds a, Grounds b);

/// The largest mean distance at which a score of at least `score` (in [0, 1]) is possible, a little
/// more for rounding; infinite for 0.
[[nodiscard]] double maxDistanceForScore(double score);

/// The largest score of shapes at least this mean distance apart, a little more for rounding.
[[nodiscard]] double maxScoreAtDistance(double distance);

/// How many octaves lie between two sizes.
[[nodiscard]] double octavesBetween(double scaleA, double scaleB);

/// Name, distance and weight of every term, in a fixed order; the weights sum to 1.
[[nodiscard]] std::vector<ScoreTerm> scoreTerms(const LevelSums& sums, Grounds a, Grounds b,
                                                double agreement);

/// The terms for a piece and its whole, including the share of the piece that the whole contains.
[[nodiscard]] std::vector<ScoreTerm> partialTerms(const LevelSums& sums, Grounds a, Grounds b,
                                                  double agreement, double share);

}  // namespace shapedb
