// Enumerations of the API and those of core/ that mean the same, for client and server alike.
#pragma once

#include <optional>

#include "core/profile.h"
#include "core/segmentation/interior_kinds.h"
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

}  // namespace shapedb::wire
