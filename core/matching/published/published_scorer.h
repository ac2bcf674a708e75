// SPDX-License-Identifier: GPL-3.0-or-later
// The scorer of the paper: points and weights alone, under the best of all alignments.
#pragma once

#include <memory>

#include "core/matching/scorer.h"

namespace shapedb {

/// A signature with a single point scores no more than this against another: one weighted point leaves
/// the rotation open and says too little.
constexpr double kDegenerateCeiling = 0.9;

/// Compares shapes whose points are there. Shapes of which only one has attributes are never the same.
[[nodiscard]] std::unique_ptr<const Scorer> makePublishedScorer(const Signature& query,
                                                                const ScoreOptions& options);

}  // namespace shapedb
