// Whether points span a volume.
#pragma once

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Points closer than this to a common line or plane span no volume. Units of the unit frame.
constexpr double kFlatnessTolerance = 1e-6;

/// `points`: at least one, in the unit frame, not all equal. Errors: kCollinear, kCoplanar.
[[nodiscard]] Result<void> checkNotFlat(const PointCloud& points);

}  // namespace shapedb
