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

double reliabilityOf(Verdict verdict) noexcept {
    switch (verdict) {
        case Verdict::kNone: return 0.0;
        case Verdict::kSameObject: return 0.75;
        case Verdict::kSameObjectBent: return 0.60;
        case Verdict::kPart: return 0.80;
        case Verdict::kSameKind: return 0.87;
        case Verdict::kUnrelated: return 0.80;
    }
    return 0.0;
}

}  // namespace shapedb
