// The scorer of the default profile: statistics of the shapes as a whole, and their segments under the
// best alignment (docs/scoring.md).
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "core/matching/attributed/attributed_query.h"
#include "core/matching/attributed/segment_match.h"
#include "core/matching/attributed/statistics_bound.h"
#include "core/matching/scorer.h"

namespace shapedb {

/// Compares shapes with attributes. `query` must have them.
[[nodiscard]] std::unique_ptr<const Scorer> makeAttributedScorer(const Signature& query,
                                                                 const ScoreOptions& options);

/// What comparing whole shapes and comparing a piece with its whole have in common: the ladder of
/// bounds, each rung of which hands on what it computed (statistics, then segments, then alignment).
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
    /// The query and another shape, with what bound, score and explanation share.
    struct Pair {
        Pair(const AttributedQuery& query, const ShapeRow& row, const LevelSums& sums,
             const ScoreOptions& options);
        Pair(const Pair&) = delete;  // `comparison` keeps views
        Pair& operator=(const Pair&) = delete;

        SegmentArray segments;  ///< of the other shape
        bool exchanged;         ///< the other shape is a of `comparison`, so that both orders are one
        SegmentComparison comparison;
        AttributeDistance distance;
        double knownScale;  ///< of the other's lengths against the query's with keepScale; 0: to be found
    };

    /// Both below 1: the shapes are not the same.
    [[nodiscard]] virtual double scoreOf(const Pair& pair) const = 0;
    [[nodiscard]] virtual double boundOf(const Pair& pair) const = 0;

    [[nodiscard]] const AttributedQuery& query() const { return query_; }
    [[nodiscard]] const ScoreOptions& options() const { return options_; }
    [[nodiscard]] bool isSame(const ShapeRow& shape) const {
        return sameShape(query_.row(), shape, options_.keepScale);
    }

  private:
    const AttributedQuery query_;
    const ScoreOptions options_;
    const StatisticsRule rule_;
    // Made by the first scan: its tables cost as much as scoring a shape.
    mutable std::once_flag once_;
    mutable std::optional<StatisticsBound> statisticsBound_;
};

}  // namespace shapedb
