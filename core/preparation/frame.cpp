// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/base/count_text.h"
#include "core/base/return_if_error.h"
#include "core/geometry/box.h"

namespace shapedb {

namespace {

Result<void> checkCoordinates(const PointCloud& scan) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
        const double coordinates[3] = {scan[i].x, scan[i].y, scan[i].z};
        for (int axis = 0; axis < 3; ++axis) {
            const double value = coordinates[axis];
            const char name = static_cast<char>('x' + axis);
            if (!std::isfinite(value)) {
                return fail(ErrorCode::kNonFiniteCoordinate,
                            "coordinate " + std::string(1, name) + " of point " + std::to_string(i) + " is " +
                                (std::isnan(value) ? "NaN" : "infinite") +
                                "; remove points without a position before uploading");
            }
            if (std::abs(value) > kMaxCoordinate) {
                return fail(ErrorCode::kCoordinateOutOfRange,
                            "coordinate " + std::string(1, name) + " of point " + std::to_string(i) +
                                " exceeds the largest magnitude 3.4e38; choose a larger unit of length");
            }
        }
    }
    return {};
}

}  // namespace

Result<Frame> frameOf(const PointCloud& scan) {
    if (scan.size() < 4) {
        return fail(ErrorCode::kTooFewPoints,
                    "the scan has " + countText(scan.size(), "point") + "; at least 4 are needed");
    }
    if (scan.size() >= std::numeric_limits<std::uint32_t>::max()) {
        return fail(ErrorCode::kPointLimitExceeded, "the scan has more than 4,294,967,294 points");
    }
    RETURN_IF_ERROR(checkCoordinates(scan));
    const Box box = boxOf(scan);
    const Point3 half = 0.5 * box.high - 0.5 * box.low;
    const double halfExtent = std::max({half.x, half.y, half.z});
    if (halfExtent == 0.0) {
        return fail(ErrorCode::kAllPointsEqual,
                    "all " + std::to_string(scan.size()) + " points are the same point");
    }
    if (halfExtent < kMinHalfExtent) {
        return fail(ErrorCode::kCoordinateOutOfRange,
                    "the whole scan is smaller than 1.2e-38 units; choose a smaller unit of length");
    }
    int exponent = 0;
    // The half extent is less than 2^exponent, so that coordinates are in [-1, 1].
    std::frexp(halfExtent, &exponent);
    return Frame{0.5 * box.high + 0.5 * box.low, std::ldexp(1.0, exponent)};
}

}  // namespace shapedb
