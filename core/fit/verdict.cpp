// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/verdict.h"

namespace shapedb {

namespace {

// Up to this misfit two scans are of one object.
constexpr double kSameMisfit = 0.16;

// A piece whose signature differs less is nearly all of the object.
constexpr double kPartDistance = 0.2;

// A bent object keeps its signature, which measures along paths inside, better than its outline.
constexpr double kBentDistance = 0.15;
constexpr double kBentMisfit = 0.4;

// Of the mean of distance and misfit.
constexpr double kKindDistance = 0.62;

// The share of such verdicts that were right, in the order of Verdict.
constexpr double kReliability[] = {0.0, 0.75, 0.60, 0.80, 0.87, 0.80};

}  // namespace

Verdict verdictOf(double signatureDistance, const FitResult& fit, bool reflection) noexcept {
    if (fit.misfit <= kSameMisfit) {
        const bool part = fit.kind == FitKind::kPiece && signatureDistance > kPartDistance;
        return part ? Verdict::kPart : Verdict::kSameObject;
    }
    const bool bent = signatureDistance <= kBentDistance && fit.misfit <= kBentMisfit;
    if (bent && reflection) return Verdict::kSameObjectBent;
    const bool alike = 0.5 * (signatureDistance + fit.misfit) <= kKindDistance;
    return alike ? Verdict::kSameKind : Verdict::kUnrelated;
}

double reliabilityOf(Verdict verdict) noexcept { return kReliability[static_cast<std::size_t>(verdict)]; }

}  // namespace shapedb
