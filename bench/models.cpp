// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/models.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/fit/surface_points.h"
#include "core/geometry/box.h"
#include "core/geometry/motion.h"
#include "core/geometry/neighbours.h"
#include "core/synthetic/degrade.h"
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

namespace {

constexpr std::size_t kLeastLeft = 200;  // a loss that leaves fewer points does not happen

PointCloud withoutGrazing(const PointCloud& seen, const SurfacePoints& surface, const Point3& view,
                          double grazing, Random& random) {
    PointCloud places;
    for (std::size_t i = 0; i < surface.size(); ++i) places.push_back(surface.position(i));
    const NeighbourIndex index(places);
    std::vector<Neighbour> found;
    PointCloud left;
    for (const Point3& p : seen) {
        index.nearest(p, 1, found);
        const double cosine = std::abs(dot(surface.normal(found.front().point), view));
        const double kept = std::clamp((cosine - 0.5 * grazing) / grazing, 0.0, 1.0);
        if (random.uniform() < kept) left.push_back(p);
    }
    return left.size() < kLeastLeft ? seen : left;
}

}  // namespace

Result<PointCloud> oneSidedScan(const PointCloud& model, const OneSidedSettings& settings, std::uint64_t seed,
                                const RunContext& context) {
    Random random(seed);
    const double diagonal = boxOf(model).diagonal();
    const Point3 view = randomDirection(random);
    PointCloud seen = seenFrom(model, view);
    const auto surface = makeSurfacePoints(seen, context);
    if (!surface && (surface.error().code == ErrorCode::kCancelled ||
                     surface.error().code == ErrorCode::kDeadlineExceeded)) {
        return fail(surface.error());
    }
    if (surface && settings.grazing > 0.0) {
        seen = withoutGrazing(seen, *surface, view, settings.grazing, random);
    }
    for (std::uint64_t holes = random.below(3); holes > 0; --holes) {
        const Point3 centre = seen[random.below(seen.size())];
        PointCloud left = withHole(seen, centre, diagonal * settings.hole * random.uniform());
        if (left.size() >= kLeastLeft) seen = std::move(left);
    }
    const double count = std::exp(random.uniform(std::log(static_cast<double>(settings.least)),
                                                 std::log(static_cast<double>(settings.most))));
    seen = subsample(seen, static_cast<std::size_t>(count), random.next());
    for (Point3& p : seen) {
        p = p + (settings.noise * diagonal) * Point3{random.normal(), random.normal(), random.normal()};
    }
    const Matrix3 turn = randomRotation(random);
    for (Point3& p : seen) p = rotate(turn, p);
    return seen;
}

}  // namespace shapedb::bench
