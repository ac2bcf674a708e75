// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/score.h"

#include <algorithm>
#include <cmath>
#include <sstream>

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

namespace {

// The distance, in units of what unrelated shapes differ by, at which the score is 0.5.
constexpr double kHalfWay = 0.5;

}  // namespace

double scoreOfDistance(double distance) noexcept {
    const double d = distance / kHalfWay;
    return 1.0 / (1.0 + d * d);
}

double distanceOfScore(double score) noexcept {
    return score > 0.0 ? kHalfWay * std::sqrt(std::max(0.0, 1.0 / score - 1.0)) : INFINITY;
}

Result<void> validate(const ScoreOptions& options) {
    if (options.kernelWidth >= kMinKernelWidth && options.kernelWidth <= kMaxKernelWidth) return {};
    std::ostringstream message;
    message << "kernel_width is " << options.kernelWidth << "; it must be " << kMinKernelWidth << " to "
            << kMaxKernelWidth;
    return fail(ErrorCode::kInvalidArgument, message.str());
}

}  // namespace shapedb
