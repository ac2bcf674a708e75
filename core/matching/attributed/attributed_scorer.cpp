#include "core/matching/attributed/attributed_scorer.h"

#include "core/matching/attributed/partial_scorer.h"
#include "core/matching/attributed/whole_scorer.h"

namespace shapedb {

AttributedScorer::AttributedScorer(const Signature& query, const ScoreOptions& options, StatisticsRule rule)
    : query_(query), options_(options), rule_(rule) {}

AttributedScorer::Pair::Pair(const AttributedQuery& query, const ShapeRow& row, const LevelSums& sums,
                             const ScoreOptions& options)
    : segments(row),
      exchanged(canonicalLess(row, query.row())),
      comparison(exchanged ? segments : query.segments(), exchanged ? query.segments() : segments, options),
      distance(attributeDistance(statisticsDistance(sums, query.quality(), row.quality), query.quality(),
                                 row.quality,
                                 options.keepScale ? octavesBetween(query.scale(), row.scale) : 0.0)),
      knownScale(options.keepScale ? query.scale() / row.scale : 0.0) {}

double AttributedScorer::score(const ShapeRow& shape) const {
    return isSame(shape) ? 1.0 : scoreOf(Pair(query_, shape, query_.levelSums(shape), options_));
}

double AttributedScorer::bound(const ShapeRow& shape) const {
    return isSame(shape) ? 1.0 : boundOf(Pair(query_, shape, query_.levelSums(shape), options_));
}

void AttributedScorer::scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
                            std::vector<Survivor>& left, ScanCounts& counts) const {
    std::call_once(once_, [this] { statisticsBound_.emplace(query_, rule_); });
    statisticsBound_->scan(rows, wanted, least, left, counts);
}

std::optional<double> AttributedScorer::scoreIfReaches(const ShapeRow& shape, const Survivor& survivor,
                                                       double least) const {
    if (isSame(shape)) return 1.0;
    const Pair pair(query_, shape, survivor.findings.as<LevelSums>(), options_);
    if (boundOf(pair) < least) return std::nullopt;
    return scoreOf(pair);
}

std::unique_ptr<const Scorer> makeAttributedScorer(const Signature& query, const ScoreOptions& options) {
    if (options.partial) return std::make_unique<PartialScorer>(query, options);
    return std::make_unique<WholeScorer>(query, options);
}

}  // namespace shapedb
