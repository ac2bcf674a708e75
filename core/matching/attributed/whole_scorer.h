// Compares whole shapes with attributes. Symmetric bit for bit.
#pragma once

#include "core/matching/attributed/attributed_scorer.h"

namespace shapedb {

class WholeScorer final : public AttributedScorer {
  public:
    WholeScorer(const Signature& query, const ScoreOptions& options);
    [[nodiscard]] Explanation explain(const ShapeRow& shape) const override;

  protected:
    [[nodiscard]] double scoreOf(const Pair& pair) const override;
    [[nodiscard]] double boundOf(const Pair& pair) const override;
};

}  // namespace shapedb
