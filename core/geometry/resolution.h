// SPDX-License-Identifier: Apache-2.0
// How finely floating-point numbers hold the coordinates of a scan: far from the origin they lie further
// apart, and rounded to them a shape loses its details, then itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/geometry/box.h"
#include "core/geometry/main_part.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Steps of single precision across a scan: with fewer they are coarser than the details that tell shapes
/// apart.
constexpr double kLeastSteps = 1'000.0;
/// The same along each axis on which the scan is not flat: a thin scan needs fewer across its thin
/// side.
constexpr double kLeastStepsOfAxis = 64.0;
/// Steps of double precision across a scan: a millionth of its size.
constexpr double kLeastDoubleSteps = 0x1p20;

/// A float32 rounds a coordinate beyond this many box diagonals by more than 2^-20 (a millionth) of the
/// diagonal: it has 24 significant bits, and 24 = 20 + log2(16).
constexpr double kFarFromOrigin = 16.0;

/// A scan whose coordinates are too far apart. Scan units.
struct CoarseCoordinates {
    double largest = 0.0;        ///< coordinate, by magnitude
    double step = 0.0;           ///< from there to the next number
    double across = 0.0;         ///< size of the scan, or its extent along the axis that is concerned
    std::uint64_t outliers = 0;  ///< points that do not count as the scan

    /// "coordinates up to 4.4e+06 are 0.5 apart in single precision, but the scan is only 2.5 across",
    /// with outliers "..., without 3 points far from the others".
    [[nodiscard]] std::string text(const char* precision = "single precision") const;
};

/// Whether a coordinate lies beyond kFarFromOrigin diagonals: single precision costs digits, though not yet
/// the shape. False for points that are all equal. `box`: as below.
[[nodiscard]] bool isFarFromOrigin(const Box& box);

/// Why single precision cannot hold `points` points that fill `box`: fewer than kLeastSteps across it, fewer
/// than points would lie in a row if they were spread evenly, or fewer than kLeastStepsOfAxis along an axis.
/// Nothing if it can, and for points that are all equal. `box`: of at least one point, finite, within single
/// precision.
[[nodiscard]] std::optional<CoarseCoordinates> coarseInSinglePrecision(const Box& box, std::uint64_t points);

/// The same of the main part of a scan: outliers do not widen it. Nothing of a part that is one
/// point.
[[nodiscard]] std::optional<CoarseCoordinates> coarseInSinglePrecision(const MainPart& part);

/// Whether a scan that seems flat, or a single point, may only be so because single precision rounded it
/// there: its step is more than a millionth of the size.
[[nodiscard]] bool maybeFlattened(const MainPart& part);

/// Why double precision cannot hold the sums of `origin` and the points in `box`: fewer than
/// kLeastDoubleSteps across.
[[nodiscard]] std::optional<CoarseCoordinates> coarseInDoublePrecision(const Box& box, const Point3& origin);

/// Refuses points that were rounded to single precision where that cannot hold them, as by a file that was
/// written with it: what is left is not the shape that was scanned, and no offset brings it back. Points on a
/// coarser grid than that of single precision (voxels, corners of a model) lost nothing and pass. Points that
/// are not finite or beyond single precision are left to other checks. Errors: kCoordinateOutOfRange.
[[nodiscard]] Result<void> checkNotRounded(const PointCloud& points);

}  // namespace shapedb
