#include "core/matching/attributed/partial_scorer.h"

#include "core/matching/attributed/body_motion.h"
#include "core/matching/attributed/containment.h"
#include "core/matching/kernel.h"

namespace shapedb {

PartialScorer::PartialScorer(const Signature& query, const ScoreOptions& options)
    : AttributedScorer(query, options, StatisticsRule::kPartial) {}

double PartialScorer::scoreOf(const Pair& pair) const {
    const Containment found = containment(query().segments(), pair.segments, pair.knownScale, options());
    return belowOne(partialScore(pair.distance, pair.comparison.match().agreement, found.share));
}

double PartialScorer::boundOf(const Pair& pair) const {
    const double share = containmentBound(query().segments(), pair.segments, pair.knownScale);
    return belowOne(partialScore(pair.distance, pair.comparison.agreementBound(), share));
}

Explanation PartialScorer::explain(const ShapeRow& shape) const {
    const LevelSums sums = query().levelSums(shape);
    const Pair pair(query(), shape, sums, options());
    const ShapeRow piece = query().row();
    const Containment found = containment(query().segments(), pair.segments, pair.knownScale, options());
    const double agreement = pair.comparison.match().agreement;
    Explanation result;
    result.score = isSame(shape) ? 1.0 : belowOne(partialScore(pair.distance, agreement, found.share));
    result.similarity = found.share;
    result.dissimilarity = 1.0 - found.share;
    result.degenerate = piece.pointCount == 1 || shape.pointCount == 1;
    result.motion = pieceMotion(piece, shape, found, options().keepScale);
    result.terms = partialTerms(sums, query().quality(), shape.quality, agreement, found.share);
    addMatches(containedPairs(query().segments(), pair.segments, found, options()), found.share, result);
    listUnmatched(result, piece.pointCount, shape.pointCount);
    return result;
}

}  // namespace shapedb
