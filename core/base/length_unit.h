// SPDX-License-Identifier: Apache-2.0
// Units of length of scans: for client and server alike.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace shapedb {

enum class LengthUnit {
    kNone,  ///< unknown, or not the same for all scans
    kMillimetre,
    kCentimetre,
    kMetre,
    kInch,
};

constexpr std::array<LengthUnit, 5> kLengthUnits{LengthUnit::kNone, LengthUnit::kMillimetre,
                                                 LengthUnit::kCentimetre, LengthUnit::kMetre,
                                                 LengthUnit::kInch};

/// "none", "mm", "cm", "m" or "in".
[[nodiscard]] constexpr const char* lengthUnitName(LengthUnit unit) noexcept {
    switch (unit) {
        case LengthUnit::kNone: return "none";
        case LengthUnit::kMillimetre: return "mm";
        case LengthUnit::kCentimetre: return "cm";
        case LengthUnit::kMetre: return "m";
        case LengthUnit::kInch: return "in";
    }
    return "none";
}

/// Nothing for other names.
[[nodiscard]] constexpr std::optional<LengthUnit> lengthUnitFromName(std::string_view name) noexcept {
    for (const LengthUnit unit : kLengthUnits) {
        if (name == lengthUnitName(unit)) return unit;
    }
    return std::nullopt;
}

/// Metres in one unit; 1 for kNone.
[[nodiscard]] constexpr double metresIn(LengthUnit unit) noexcept {
    switch (unit) {
        case LengthUnit::kMillimetre: return 0.001;
        case LengthUnit::kCentimetre: return 0.01;
        case LengthUnit::kInch: return 0.0254;
        default: return 1.0;
    }
}

}  // namespace shapedb
