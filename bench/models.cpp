// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/models.h"

#include <utility>

#include "core/base/return_if_error.h"
#include "core/synthetic/families.h"

namespace shapedb::bench {

Result<std::vector<FamilyScan>> scansOfFamilies(std::size_t members, std::size_t points, std::uint64_t seed) {
    std::vector<FamilyScan> scans;
    for (const FamilyInfo& family : listFamilies()) {
        for (std::size_t i = 0; i < members; ++i) {
            const auto solid = makeMember(family.name, i, seed);
            RETURN_IF_ERROR(solid);
            ScanOptions options;
            options.count = points;
            options.seed = seed + i;
            auto scan = scanOf(*solid, options);
            RETURN_IF_ERROR(scan);
            scans.push_back({family.name, i, std::move(*scan)});
        }
    }
    return scans;
}

PointCloud halfOf(const PointCloud& points, std::size_t which) {
    PointCloud half;
    half.reserve(points.size() / 2 + 1);
    for (std::size_t i = which; i < points.size(); i += 2) half.push_back(points[i]);
    return half;
}

}  // namespace shapedb::bench
