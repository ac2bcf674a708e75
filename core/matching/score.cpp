// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/score.h"

#include "core/matching/scorer.h"

namespace shapedb {

double score(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return makeScorer(a, options)->score(b);
}

double scoreUpperBound(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return makeScorer(a, options)->bound(b);
}

Explanation explain(const Signature& a, const Signature& b, const ScoreOptions& options) {
    return makeScorer(a, options)->explain(b);
}

}  // namespace shapedb
