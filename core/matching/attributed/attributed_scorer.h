// SPDX-License-Identifier: GPL-3.0-or-later
// The scorer of the default profile: statistics of the shapes as a whole, and their segments under the
// best alignment (docs/scoring.md).
#pragma once

#include <memory>

#include "core/matching/scorer.h"

namespace shapedb {

/// Compares shapes with attributes, which `query` must have. Partial: the query is a piece, which is compared
/// with whole shapes. Otherwise symmetric bit for bit.
[[nodiscard]] std::unique_ptr<const Scorer> makeAttributedScorer(const Signature& query,
                                                                 const ScoreOptions& options);

}  // namespace shapedb
