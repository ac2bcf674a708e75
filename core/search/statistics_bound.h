// The first rungs of the ladder of bounds: which signatures of a block the statistics alone rule out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/matching/attributed/attribute_score.h"
#include "core/search/packed_statistics.h"
#include "core/search/signature_block.h"

namespace shapedb {

/// Bounds of many candidates against one query with attributes. Immutable, thread-safe.
class StatisticsBound {
  public:
    StatisticsBound(const Signature& query, const ScoreOptions& options,
                    Instructions use = Instructions::kBest);

    struct Left {
        std::uint32_t row = 0;
        double distance = 0.0;  ///< the mean distance of attribute_score.h is no smaller
    };
    struct Counts {
        std::uint64_t afterFirstHalf = 0;
        std::uint64_t afterStatistics = 0;
    };

    /// Appends to `left` the attributed rows of `block` that could score `needed` or more if the rest
    /// of them agreed in full. `wanted`: one a row, 0 leaves it out; empty: all.
    void scan(const SignatureBlock& block, const std::vector<std::uint8_t>& wanted, double needed,
              std::vector<Left>& left, Counts& counts) const;

  private:
    using HalfWeights = std::array<double, kKindsPerHalf>;

    StatisticsDifference difference_;
    double queryScale_;
    bool keepScale_;
    // By the candidate's quality.
    std::vector<HalfWeights> first_, second_;
};

}  // namespace shapedb
