// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/integration/support/scans.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"
#include "core/synthetic/solid.h"

namespace shapedb::testing {
namespace {

PointCloud valueOf(Result<PointCloud> points) {
    if (points) return std::move(*points);
    ADD_FAILURE() << points.error().message;
    return {};
}

}  // namespace

Scan pack(const PointCloud& points) {
    Scan scan;
    for (const Point3& p : points) {
        for (const double c : {p.x, p.y, p.z}) scan.push_back(static_cast<float>(c));
    }
    return scan;
}

PointCloud unpack(const Scan& scan) {
    PointCloud points;
    for (std::size_t i = 0; i + 2 < scan.size(); i += 3)
        points.push_back({scan[i], scan[i + 1], scan[i + 2]});
    return points;
}

Scan dumbbell(std::uint64_t seed, std::size_t points) {
    return pack(valueOf(sampleBoundary(makeDumbbell().solid, points, seed)));
}

Scan familyScan(const std::string& family, std::size_t index, std::uint64_t seed, std::size_t points) {
    const auto member = makeMember(family, index, 7);
    if (!member) {
        ADD_FAILURE() << member.error().message;
        return {};
    }
    ScanOptions options;
    options.count = points;
    options.noise = 0.002;
    options.seed = seed;
    return pack(valueOf(scanOf(*member, options)));
}

Scan openSheet() {
    PointCloud points;
    for (int i = 0; i < 40; ++i) {
        for (int j = 0; j < 40; ++j) {
            const double x = 0.05 * i - 1.0 + 0.001 * ((7 * i + 3 * j) % 11);
            const double y = 0.05 * j - 1.0 + 0.001 * ((5 * i + 2 * j) % 13);
            points.push_back({x, y, 0.01 * (x * x + y * y)});
        }
    }
    return pack(points);
}

Scan slowScan(std::uint64_t seed, std::size_t points) {
    return pack(valueOf(sampleBoundary(makeJack().solid, points, seed)));
}

}  // namespace shapedb::testing
