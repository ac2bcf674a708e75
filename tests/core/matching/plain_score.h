// SPDX-License-Identifier: GPL-3.0-or-later
// The published score straight from its definition, sharing nothing with the code under test: full rotation
// matrices, every (i, j, k, l, reflection), matching by repeated search.
#pragma once

#include <functional>
#include <string>

#include "core/matching/score.h"
#include "core/signature/signature.h"

namespace shapedb::testing_support {

/// Calls `visit` with every alignment of b's points onto a's, each a rotation (determinant -1
/// when mirrored) about the anchors.
void forEveryAlignment(const std::vector<Point3>& a, const std::vector<Point3>& b, bool reflection,
                       const std::function<void(const Matrix3&)>& visit);

enum class Matching { kGreedy, kOptimal };

/// `score` without pruning, ordering or bounds. kOptimal matches each alignment one to one with
/// the largest possible sum instead of greedily (exhaustive over subsets: a dozen points at most).
double plainScore(const Signature& a, const Signature& b, const ScoreOptions& options,
                  Matching matching = Matching::kGreedy);

}  // namespace shapedb::testing_support
