// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/attributed_scorer.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "core/matching/attributed/attributed_query.h"
#include "core/matching/attributed/body_motion.h"
#include "core/matching/attributed/containment.h"
#include "core/matching/attributed/segment_match.h"
#include "core/matching/attributed/statistics_bound.h"
#include "core/matching/kernel.h"

namespace shapedb {

namespace {

// What comparing whole shapes and comparing a piece with its whole have in common: the ladder of
// bounds, each rung of which hands on what it computed (statistics, then segments, then alignment).
class AttributedScorer : public Scorer {
  public:
    AttributedScorer(const Signature& query, const ScoreOptions& options, StatisticsRule rule);

    bool compares(const ShapeRow& shape) const final { return shape.attributed(); }
    double score(const ShapeRow& shape) const final;
    double bound(const ShapeRow& shape) const final;
    void scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
              std::vector<Survivor>& left, ScanCounts& counts) const final;
    std::optional<double> scoreIfReaches(const ShapeRow& shape, const Survivor& survivor,
                                         double least) const final;

  protected:
    // The query and another shape, with what bound, score and explanation share.
    struct Pair {
        Pair(const AttributedQuery& query, const ShapeRow& row, const LevelSums& sums,
             const ScoreOptions& options);
        Pair(const Pair&) = delete;  // `comparison` keeps views
        Pair& operator=(const Pair&) = delete;

        SegmentArray segments;  // of the other shape
        bool exchanged;         // the other shape is a of `comparison`, so that both orders are one
        SegmentComparison comparison;
        AttributeDistance distance;
        double knownScale;  // of the other's lengths against the query's with keepScale; 0: to be found
    };

    // Both below 1: the shapes are not the same.
    virtual double scoreOf(const Pair& pair) const = 0;
    virtual double boundOf(const Pair& pair) const = 0;

    const AttributedQuery& query() const { return query_; }
    const ScoreOptions& options() const { return options_; }
    bool isSame(const ShapeRow& shape) const { return sameShape(query_.row(), shape, options_.keepScale); }

  private:
    const AttributedQuery query_;
    const ScoreOptions options_;
    const StatisticsRule rule_;
    // Made by the first scan: its tables cost as much as scoring a shape.
    mutable std::once_flag once_;
    mutable std::optional<StatisticsBound> statisticsBound_;
};

AttributedScorer::AttributedScorer(const Signature& query, const ScoreOptions& options, StatisticsRule rule)
    : query_(query), options_(options), rule_(rule) {}

AttributedScorer::Pair::Pair(const AttributedQuery& query, const ShapeRow& row, const LevelSums& sums,
                             const ScoreOptions& options)
    : segments(row),
      exchanged(canonicalLess(row, query.row())),
      comparison(exchanged ? segments : query.segments(), exchanged ? query.segments() : segments, options),
      distance(attributeDistance(statisticsDistance(sums, query.grounds(), groundsOf(row)), query.grounds(),
                                 groundsOf(row),
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

// Compares whole shapes. Symmetric bit for bit.
class WholeScorer final : public AttributedScorer {
  public:
    WholeScorer(const Signature& query, const ScoreOptions& options);
    Explanation explain(const ShapeRow& shape) const override;

  protected:
    double scoreOf(const Pair& pair) const override;
    double boundOf(const Pair& pair) const override;

  private:
    static double scoreAt(const Pair& pair, double agreement) {
        return belowOne(attributeScore(pair.distance, agreement));
    }
};

WholeScorer::WholeScorer(const Signature& query, const ScoreOptions& options)
    : AttributedScorer(query, options,
                       options.keepScale ? StatisticsRule::kWholeAndSize : StatisticsRule::kWhole) {}

double WholeScorer::scoreOf(const Pair& pair) const {
    return scoreAt(pair, pair.comparison.match().agreement);
}

double WholeScorer::boundOf(const Pair& pair) const {
    return scoreAt(pair, pair.comparison.agreementBound());
}

Explanation WholeScorer::explain(const ShapeRow& shape) const {
    const LevelSums sums = query().levelSums(shape);
    const Pair pair(query(), shape, sums, options());
    const ShapeRow a = pair.exchanged ? shape : query().row();
    const ShapeRow b = pair.exchanged ? query().row() : shape;
    const SegmentMatch match = pair.comparison.match();
    Explanation result;
    result.score = isSame(shape) ? 1.0 : scoreAt(pair, match.agreement);
    result.similarity = match.agreement;
    result.dissimilarity = std::max(0.0, 1.0 - match.agreement);
    result.degenerate = a.pointCount == 1 || b.pointCount == 1;
    result.motion = bodyMotion(a, b, match.rotation, match.reflected, options().keepScale);
    result.terms = scoreTerms(sums, query().grounds(), groundsOf(shape), match.agreement);
    addMatches(pair.comparison.pairs(match), match.agreement, result);
    listUnmatched(result, a.pointCount, b.pointCount);
    // Each side's distances are in its own units.
    return pair.exchanged ? exchanged(std::move(result), 1.0) : result;
}

// Compares a piece (the query) with whole shapes. Not symmetric.
class PartialScorer final : public AttributedScorer {
  public:
    PartialScorer(const Signature& query, const ScoreOptions& options);
    Explanation explain(const ShapeRow& shape) const override;

  protected:
    double scoreOf(const Pair& pair) const override;
    double boundOf(const Pair& pair) const override;

  private:
    static double scoreAt(const Pair& pair, double agreement, double share) {
        return belowOne(partialScore(pair.distance, agreement, share));
    }
};

PartialScorer::PartialScorer(const Signature& query, const ScoreOptions& options)
    : AttributedScorer(query, options, StatisticsRule::kPartial) {}

double PartialScorer::scoreOf(const Pair& pair) const {
    const Containment found = containment(query().segments(), pair.segments, pair.knownScale, options());
    return scoreAt(pair, pair.comparison.match().agreement, found.share);
}

double PartialScorer::boundOf(const Pair& pair) const {
    const double share = containmentBound(query().segments(), pair.segments, pair.knownScale);
    return scoreAt(pair, pair.comparison.agreementBound(), share);
}

Explanation PartialScorer::explain(const ShapeRow& shape) const {
    const LevelSums sums = query().levelSums(shape);
    const Pair pair(query(), shape, sums, options());
    const ShapeRow piece = query().row();
    const Containment found = containment(query().segments(), pair.segments, pair.knownScale, options());
    const double agreement = pair.comparison.match().agreement;
    Explanation result;
    result.score = isSame(shape) ? 1.0 : scoreAt(pair, agreement, found.share);
    result.similarity = found.share;
    result.dissimilarity = 1.0 - found.share;
    result.degenerate = piece.pointCount == 1 || shape.pointCount == 1;
    result.motion = pieceMotion(piece, shape, found, options().keepScale);
    result.terms = partialTerms(sums, query().grounds(), groundsOf(shape), agreement, found.share);
    addMatches(containedPairs(query().segments(), pair.segments, found, options()), found.share, result);
    listUnmatched(result, piece.pointCount, shape.pointCount);
    return result;
}

}  // namespace

std::unique_ptr<const Scorer> makeAttributedScorer(const Signature& query, const ScoreOptions& options) {
    if (options.partial) return std::make_unique<PartialScorer>(query, options);
    return std::make_unique<WholeScorer>(query, options);
}

}  // namespace shapedb
