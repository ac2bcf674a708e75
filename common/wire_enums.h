// SPDX-License-Identifier: Apache-2.0
// Enumerations of the API and those of core/ that mean the same, for client and server alike.
#pragma once

#include <optional>

#include "core/base/length_unit.h"
#include "core/fit/verdict_kinds.h"
#include "core/profile.h"
#include "core/segmentation/interior_kinds.h"
#include "shapedb/v1/search_service.pb.h"
#include "shapedb/v1/types.pb.h"

namespace shapedb::wire {

[[nodiscard]] inline v1::Profile toProto(Profile profile) {
    return profile == Profile::kPaper ? v1::PROFILE_PAPER : v1::PROFILE_DEFAULT;
}

[[nodiscard]] inline v1::InteriorMethod toProto(InteriorMethod method) {
    return method == InteriorMethod::kWalk ? v1::INTERIOR_METHOD_WALK : v1::INTERIOR_METHOD_ADAPTIVE;
}

[[nodiscard]] inline v1::InteriorSource toProto(InteriorSource source) {
    switch (source) {
        case InteriorSource::kWalk: return v1::INTERIOR_SOURCE_WALK;
        case InteriorSource::kPotential: return v1::INTERIOR_SOURCE_POTENTIAL;
        case InteriorSource::kThickened: return v1::INTERIOR_SOURCE_THICKENED;
    }
    return v1::INTERIOR_SOURCE_UNSPECIFIED;
}

[[nodiscard]] inline v1::Verdict toProto(Verdict verdict) {
    switch (verdict) {
        case Verdict::kNone: return v1::VERDICT_UNSPECIFIED;
        case Verdict::kSameObject: return v1::VERDICT_SAME_OBJECT;
        case Verdict::kSameObjectBent: return v1::VERDICT_SAME_OBJECT_BENT;
        case Verdict::kPart: return v1::VERDICT_PART;
        case Verdict::kSameKind: return v1::VERDICT_SAME_KIND;
        case Verdict::kUnrelated: return v1::VERDICT_UNRELATED;
    }
    return v1::VERDICT_UNSPECIFIED;
}

[[nodiscard]] inline v1::LengthUnit toProto(LengthUnit unit) {
    switch (unit) {
        case LengthUnit::kNone: return v1::LENGTH_UNIT_NONE;
        case LengthUnit::kMillimetre: return v1::LENGTH_UNIT_MILLIMETRE;
        case LengthUnit::kCentimetre: return v1::LENGTH_UNIT_CENTIMETRE;
        case LengthUnit::kMetre: return v1::LENGTH_UNIT_METRE;
        case LengthUnit::kInch: return v1::LENGTH_UNIT_INCH;
    }
    return v1::LENGTH_UNIT_UNSPECIFIED;
}

[[nodiscard]] inline v1::InteriorDoubt toProto(InteriorDoubt doubt) {
    switch (doubt) {
        case InteriorDoubt::kNone: return v1::INTERIOR_DOUBT_NONE;
        case InteriorDoubt::kNoSurface: return v1::INTERIOR_DOUBT_NO_SURFACE;
        case InteriorDoubt::kThinWalls: return v1::INTERIOR_DOUBT_THIN_WALLS;
        case InteriorDoubt::kFewPoints: return v1::INTERIOR_DOUBT_FEW_POINTS;
    }
    return v1::INTERIOR_DOUBT_UNSPECIFIED;
}

// The way back: empty for UNSPECIFIED and for numbers that only a newer version knows.

[[nodiscard]] inline std::optional<Profile> fromProto(v1::Profile profile) {
    switch (profile) {
        case v1::PROFILE_PAPER: return Profile::kPaper;
        case v1::PROFILE_DEFAULT: return Profile::kDefault;
        default: return std::nullopt;
    }
}

[[nodiscard]] inline std::optional<InteriorMethod> fromProto(v1::InteriorMethod method) {
    switch (method) {
        case v1::INTERIOR_METHOD_WALK: return InteriorMethod::kWalk;
        case v1::INTERIOR_METHOD_ADAPTIVE: return InteriorMethod::kAdaptive;
        default: return std::nullopt;
    }
}

[[nodiscard]] inline std::optional<InteriorSource> fromProto(v1::InteriorSource source) {
    switch (source) {
        case v1::INTERIOR_SOURCE_WALK: return InteriorSource::kWalk;
        case v1::INTERIOR_SOURCE_POTENTIAL: return InteriorSource::kPotential;
        case v1::INTERIOR_SOURCE_THICKENED: return InteriorSource::kThickened;
        default: return std::nullopt;
    }
}

[[nodiscard]] inline std::optional<LengthUnit> fromProto(v1::LengthUnit unit) {
    switch (unit) {
        case v1::LENGTH_UNIT_NONE: return LengthUnit::kNone;
        case v1::LENGTH_UNIT_MILLIMETRE: return LengthUnit::kMillimetre;
        case v1::LENGTH_UNIT_CENTIMETRE: return LengthUnit::kCentimetre;
        case v1::LENGTH_UNIT_METRE: return LengthUnit::kMetre;
        case v1::LENGTH_UNIT_INCH: return LengthUnit::kInch;
        default: return std::nullopt;
    }
}

// kNone for these.

[[nodiscard]] inline InteriorDoubt fromProto(v1::InteriorDoubt doubt) {
    switch (doubt) {
        case v1::INTERIOR_DOUBT_NO_SURFACE: return InteriorDoubt::kNoSurface;
        case v1::INTERIOR_DOUBT_THIN_WALLS: return InteriorDoubt::kThinWalls;
        case v1::INTERIOR_DOUBT_FEW_POINTS: return InteriorDoubt::kFewPoints;
        default: return InteriorDoubt::kNone;
    }
}

[[nodiscard]] inline Verdict fromProto(v1::Verdict verdict) {
    switch (verdict) {
        case v1::VERDICT_SAME_OBJECT: return Verdict::kSameObject;
        case v1::VERDICT_SAME_OBJECT_BENT: return Verdict::kSameObjectBent;
        case v1::VERDICT_PART: return Verdict::kPart;
        case v1::VERDICT_SAME_KIND: return Verdict::kSameKind;
        case v1::VERDICT_UNRELATED: return Verdict::kUnrelated;
        default: return Verdict::kNone;
    }
}

}  // namespace shapedb::wire
