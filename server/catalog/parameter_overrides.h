// SPDX-License-Identifier: GPL-3.0-or-later
// Which parameters a request asks for, given those there are.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/error.h"
#include "core/pipeline.h"

namespace shapedb::catalog {

/// A profile and single values, each only if the request sets it. Units and ranges:
/// core/segmentation/options.h and core/signature/signature.h.
struct ParameterOverrides {
    /// Replaces all parameters but the unit, before the others change single ones.
    std::optional<Profile> profile;
    std::optional<double> bigBallRatio;
    std::optional<double> deepAngleDegrees;
    std::optional<double> hullAngleDegrees;
    std::optional<double> mergeRatio;
    std::optional<double> mergeContrast;
    std::optional<double> minSegmentShare;
    std::optional<std::uint32_t> maxSegments;
    std::optional<std::uint32_t> decimateTo;
    std::optional<double> outlierRatio;
    std::optional<double> smoothingReach;
    std::optional<double> thinning;
    std::optional<InteriorMethod> interiorMethod;
    std::optional<std::uint32_t> maxPoints;
    std::optional<bool> attributes;
    std::optional<bool> views;
    std::optional<LengthUnit> unit;

    /// The parameters of something that has some already. Errors: kInvalidArgument (names parameter, value
    /// and range).
    [[nodiscard]] Result<ShapeParameters> applyTo(const ShapeParameters& current) const;
    /// The parameters of something new: the default profile unless another is named. Errors: as `applyTo`.
    [[nodiscard]] Result<ShapeParameters> ofNew() const;
};

}  // namespace shapedb::catalog
