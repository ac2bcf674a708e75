// Compares a piece (the query) with whole shapes. Not symmetric.
#pragma once

#include "core/matching/attributed/attributed_scorer.h"

namespace shapedb {

class PartialScorer final : public AttributedScorer {
  public:
    PartialScorer(const Signature& query, const ScoreOptions& options);
    [[nodiscard]] Explanation explain(const ShapeRow& shape) const override;

  protected:
    [[nodiscard]] double scoreOf(const Pair& pair) const override;
    [[nodiscard]] double boundOf(const Pair& pair) const override;
};

}  // namespace shapedb
