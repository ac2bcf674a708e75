#include "core/matching/attributed/whole_scorer.h"

#include <algorithm>

#include "core/matching/attributed/body_motion.h"
#include "core/matching/kernel.h"

namespace shapedb {

WholeScorer::WholeScorer(const Signature& query, const ScoreOptions& options)
    : AttributedScorer(query, options,
                       options.keepScale ? StatisticsRule::kWholeAndSize : StatisticsRule::kWhole) {}

double WholeScorer::scoreOf(const Pair& pair) const {
    return belowOne(attributeScore(pair.distance, pair.comparison.match().agreement));
}

double WholeScorer::boundOf(const Pair& pair) const {
    return belowOne(attributeScore(pair.distance, pair.comparison.agreementBound()));
}

Explanation WholeScorer::explain(const ShapeRow& shape) const {
    const LevelSums sums = query().levelSums(shape);
    const Pair pair(query(), shape, sums, options());
    const ShapeRow a = pair.exchanged ? shape : query().row();
    const ShapeRow b = pair.exchanged ? query().row() : shape;
    const SegmentMatch match = pair.comparison.match();
    Explanation result;
    result.score = isSame(shape) ? 1.0 : belowOne(attributeScore(pair.distance, match.agreement));
    result.similarity = match.agreement;
    result.dissimilarity = std::max(0.0, 1.0 - match.agreement);
    result.degenerate = a.pointCount == 1 || b.pointCount == 1;
    result.motion = bodyMotion(a, b, match.rotation, match.reflected, options().keepScale);
    result.terms = scoreTerms(sums, query().quality(), shape.quality, match.agreement);
    addMatches(pair.comparison.pairs(match), match.agreement, result);
    listUnmatched(result, a.pointCount, b.pointCount);
    // Each side's distances are in its own units.
    return pair.exchanged ? exchanged(std::move(result), 1.0) : result;
}

}  // namespace shapedb
