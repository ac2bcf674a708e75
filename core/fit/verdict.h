// SPDX-License-Identifier: GPL-3.0-or-later
// What a verified hit is to the query, in one word, and how often that word is right.
#pragma once

#include "core/fit/fit.h"
#include "core/fit/verdict_kinds.h"

namespace shapedb {

/// From the distance of the signatures (distanceOfScore) and the fit. docs/verify.md has the rule. Without
/// `reflection` no bent object is recognised: signatures do not tell one from its mirror image.
[[nodiscard]] Verdict verdictOf(double signatureDistance, const FitResult& fit, bool reflection) noexcept;

/// The share of hits with this verdict for which it is true, in [0, 1]; 0 of kNone. Measured by
/// `shapedb-bench verdicts` with searches of synthetic shapes, half of which are not in the gallery; another
/// collection has other shares.
[[nodiscard]] double reliabilityOf(Verdict verdict) noexcept;

}  // namespace shapedb
