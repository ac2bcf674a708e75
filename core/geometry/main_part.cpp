// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/main_part.h"

namespace shapedb::main_part {

Box reachOf(PointCloud& sample, double share) {
    const auto last = sample.size() - 1;
    const auto leftOut = static_cast<std::size_t>(share * static_cast<double>(last));
    const auto atRank = [&](double Point3::*axis, std::size_t rank) {
        const auto at = sample.begin() + static_cast<std::ptrdiff_t>(rank);
        std::nth_element(sample.begin(), at, sample.end(),
                         [&](const Point3& a, const Point3& b) { return a.*axis < b.*axis; });
        return (*at).*axis;
    };
    Box middle;
    for (const std::size_t rank : {leftOut, last - leftOut}) {
        middle.add(Point3{atRank(&Point3::x, rank), atRank(&Point3::y, rank), atRank(&Point3::z, rank)});
    }
    const Point3 extent = middle.extent();
    // std::hypot, since the square of a small extent may be zero; halves, since the sum of large coordinates
    // may be infinite.
    const double reach = kMainReach * std::hypot(extent.x, extent.y, extent.z);
    const Point3 centre = 0.5 * middle.low + 0.5 * middle.high;
    if (reach == 0.0) return middle;
    const Point3 arms{reach, reach, reach};
    return {centre - arms, centre + arms};
}

}  // namespace shapedb::main_part
