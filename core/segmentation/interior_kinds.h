// SPDX-License-Identifier: Apache-2.0
// How an interior may be found, and where one came from. Kept apart from core/segmentation because
// the client library and the wire use these two as well.
#pragma once

#include <optional>
#include <string>

namespace shapedb {

/// How the interior of a shape is distinguished from its outside. The names are persisted.
enum class InteriorMethod : int {
    kWalk = 0,      ///< the paper's walk with one fixed angle; finding nothing inside is an error
    kAdaptive = 1,  ///< chosen from the shape itself; always gives an interior, and its quality
};

/// Where an interior came from.
enum class InteriorSource : int {
    kWalk = 0,       ///< walking in from outside, at the angle reported
    kPotential = 1,  ///< the potential: a walk would leak in, or be shut out of a cavity
    kThickened = 2,  ///< no side can be told: all tetrahedra close to the points
};

/// Why the interior is not to be trusted, beyond what its quality says.
enum class InteriorDoubt : int {
    kNone = 0,
    kNoSurface =
        1,  ///< the points fill space, or noise is as thick as the parts: there is no surface to be inside of
    kThinWalls = 2,  ///< walls as thin as the sampling resolves: their sides cannot be told apart
    kFewPoints = 3,  ///< fewer than 1,000: they leave open what the shape is like
};

/// "none", "no_surface", "thin_walls" or "few_points".
[[nodiscard]] inline const char* interiorDoubtName(InteriorDoubt doubt) noexcept {
    switch (doubt) {
        case InteriorDoubt::kNone: return "none";
        case InteriorDoubt::kNoSurface: return "no_surface";
        case InteriorDoubt::kThinWalls: return "thin_walls";
        case InteriorDoubt::kFewPoints: return "few_points";
    }
    return "none";
}

/// "walk" or "adaptive".
[[nodiscard]] inline const char* interiorMethodName(InteriorMethod method) noexcept {
    switch (method) {
        case InteriorMethod::kWalk: return "walk";
        case InteriorMethod::kAdaptive: return "adaptive";
    }
    return "walk";
}

/// Empty for any other name.
[[nodiscard]] inline std::optional<InteriorMethod> interiorMethodFromName(const std::string& name) {
    for (const InteriorMethod method : {InteriorMethod::kWalk, InteriorMethod::kAdaptive}) {
        if (name == interiorMethodName(method)) return method;
    }
    return std::nullopt;
}

/// "walk", "potential" or "thickened".
[[nodiscard]] inline const char* interiorSourceName(InteriorSource source) noexcept {
    switch (source) {
        case InteriorSource::kWalk: return "walk";
        case InteriorSource::kPotential: return "potential";
        case InteriorSource::kThickened: return "thickened";
    }
    return "walk";
}

}  // namespace shapedb
