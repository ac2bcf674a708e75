// SPDX-License-Identifier: GPL-3.0-or-later
// The size of a shape, by a measure that rotation does not change.
#pragma once

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The smallest diagonal of any oriented box around the points, in their unit; 0 when all
/// points are equal. Deterministic, whatever the order of the points.
///
/// The paper scales shapes "with bounding boxes" (Section 4.2) but does not say which. An
/// axis-aligned box changes when the shape is turned, and the box of least volume may jump
/// between several of nearly the same volume; the least diagonal is the same for all of them.
/// docs/algorithm.md has the figures.
///
/// Errors: kInvalidArgument when there are no points; kCancelled, kDeadlineExceeded; kOutOfMemory; kInternal.
[[nodiscard]] Result<double> smallestBoxDiagonal(const PointCloud& points, const RunContext& context = {});

}  // namespace shapedb
