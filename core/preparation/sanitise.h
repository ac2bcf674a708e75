// SPDX-License-Identifier: GPL-3.0-or-later
// The first step: from what a client sends to points that geometry can be done on.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"
#include "core/preparation/frame.h"

namespace shapedb {

/// Coordinates in the unit frame are rounded to multiples of this, the last digit of a double near 1. So
/// differences of points are exact, and no product of a few of them leaves the range of a double, however
/// close to each other or to a common plane the points lie.
constexpr double kGrid = 0x1p-52;

/// Points closer than this to a common line or plane span no volume. Units of the unit frame.
constexpr double kFlatnessTolerance = 1e-6;

struct SanitisedPoints {
    /// In the unit frame (|coordinate| <= 1, multiples of kGrid), distinct, in lexicographic order: so
    /// nothing computed from them depends on the order of the input.
    PointCloud points;
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> index into `points`
    std::uint64_t duplicates = 0;            ///< input points that repeated another (within kGrid)
    Frame frame;
};

/// Checks and normalises a scan.
///
/// Errors: those of `frameOf`; kTooFewPoints (fewer than 4 distinct); kCollinear, kCoplanar (within
/// kFlatnessTolerance); kOutOfMemory.
[[nodiscard]] Result<SanitisedPoints> sanitise(const PointCloud& scan);

/// Whether points span a volume; a check of `sanitise`. `points`: at least one, in the unit frame, not all
/// equal. Errors: kCollinear, kCoplanar.
[[nodiscard]] Result<void> checkNotFlat(const PointCloud& points);

}  // namespace shapedb
