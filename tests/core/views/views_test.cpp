// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/views.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/views/view_distance.h"

namespace shapedb {
namespace {

PointCloud scan(const char* family, std::uint64_t seed = 1) {
    ScanOptions options;
    options.randomPose = false;
    options.seed = seed;
    return *scanOf(*makeMember(family, 0, 1), options);
}

SurfacePoints surfaceOf(const PointCloud& points) { return *makeSurfacePoints(points); }

ViewSet viewsOf(const PointCloud& points) { return *makeViews(surfaceOf(points), points); }

// The mean over views of the least distance to a view of the other set.
double apart(const ViewSet& a, const ViewSet& b, bool reflection = true) {
    double sum = 0.0;
    for (const ViewSignature& view : a.views) {
        ViewOptions options;
        options.reflection = reflection;
        options.sideKnown = true;
        sum += ViewQuery(view, options).distance(b);
    }
    return sum / kViews;
}

TEST(Views, DoNotDependOnTheOrderOfTheScan) {
    const PointCloud points = scan("animal");
    PointCloud reversed(points.rbegin(), points.rend());
    EXPECT_EQ(viewsOf(points), viewsOf(reversed));
}

TEST(Views, HardlyChangeWithPoseSizeAndReflection) {
    const PointCloud points = scan("animal");
    const ViewSet still = viewsOf(points);
    const double toOther = apart(still, viewsOf(scan("table")));
    Random random(5);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = 3.0;
    motion.translation = {100.0, -50.0, 7.0};
    const ViewSet moved = viewsOf(applyToCloud(motion, points));
    EXPECT_LT(apart(still, moved, false), 0.5 * toOther);
    PointCloud mirrored = points;
    for (Point3& p : mirrored) p.x = -p.x;
    EXPECT_LT(apart(still, viewsOf(mirrored)), 0.5 * toOther);
}

TEST(Views, KeepTheSizeInScanUnits) {
    const PointCloud points = scan("mug");
    PointCloud larger;
    for (const Point3& p : points) larger.push_back(4.0 * p);
    const ViewSet a = viewsOf(points);
    const ViewSet b = viewsOf(larger);
    for (std::size_t i = 0; i < kViews; ++i) {
        EXPECT_EQ(a.views[i].levels, b.views[i].levels);
        EXPECT_FLOAT_EQ(4.0f * a.views[i].size, b.views[i].size);
    }
}

TEST(Views, OfAScanFromAnySideAreNearestToItsShape) {
    std::vector<ViewSet> gallery;
    const std::vector<FamilyInfo> families = listFamilies();
    for (const FamilyInfo& family : families) gallery.push_back(viewsOf(scan(family.name.c_str())));
    std::size_t found = 0;
    std::size_t asked = 0;
    Random random(2);
    for (std::size_t f = 0; f < families.size(); ++f) {
        const PointCloud whole = scan(families[f].name.c_str(), 9);
        for (int k = 0; k < 3; ++k) {
            const PointCloud seen = seenFrom(whole, randomDirection(random));
            const ViewQuery query(*makeViewOfScan(surfaceOf(seen)));
            std::size_t nearer = 0;
            for (const ViewSet& other : gallery) {
                nearer += query.distance(other) < query.distance(gallery[f]) ? 1 : 0;
            }
            found += nearer < 3 ? 1 : 0;
            ++asked;
        }
    }
    EXPECT_GE(10 * found, 9 * asked);
}

TEST(Views, OfSurfacePointsAloneAreMuchTheSame) {
    const PointCloud points = scan("airplane");
    const auto alone = makeViews(surfaceOf(points), {});
    ASSERT_TRUE(alone);
    EXPECT_LT(apart(*alone, viewsOf(points)), 60.0);
}

TEST(Views, IgnoreOutliersFarAway) {
    const PointCloud points = scan("bird");
    PointCloud withOutlier = points;
    withOutlier.push_back({1e6, 1e6, -1e6});
    const SurfacePoints surface = surfaceOf(points);
    EXPECT_EQ(*makeViews(surface, points), *makeViews(surface, points));
    EXPECT_LT(apart(*makeViews(surface, withOutlier), *makeViews(surface, points)), 5.0);
}

TEST(Views, OfAFlatScanAreFinite) {
    PointCloud plane;
    for (int i = 0; i < 30; ++i) {
        for (int k = 0; k < 20; ++k) plane.push_back({0.1 * i, 0.1 * k, 0.0});
    }
    const ViewSet set = viewsOf(plane);
    for (const ViewSignature& view : set.views) EXPECT_GE(view.size, 0.0f);
    EXPECT_GT(makeViewOfScan(surfaceOf(plane))->size, 0.0f);
}

TEST(SeenShare, TellsOneSideFromTheWhole) {
    for (const char* family : {"animal", "bottle"}) {
        const PointCloud points = scan(family);
        EXPECT_LT(*seenShare(surfaceOf(points)), 0.8) << family;
        EXPECT_GT(*seenShare(surfaceOf(seenFrom(points, {0.6, 0.0, 0.8}))), 0.85) << family;
    }
}

TEST(Views, AreStopped) {
    const PointCloud points = scan("fish");
    const SurfacePoints surface = surfaceOf(points);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto set = makeViews(surface, points, context);
    ASSERT_FALSE(set);
    EXPECT_EQ(set.error().code, ErrorCode::kCancelled);
}

TEST(ViewSignature, OfTheOtherEndIsTheFlippedOne) {
    const SurfacePoints surface = surfaceOf(seenFrom(scan("human"), {0.0, 1.0, 0.0}));
    const ViewSignature front = *makeViewOfScan(surface, {0.0, 1.0, 0.0});
    const ViewSignature back = *makeViewOfScan(surface, {0.0, -1.0, 0.0});
    ViewOptions options;
    options.reflection = false;
    options.sideKnown = true;
    EXPECT_GT(ViewQuery(front, options).distance(back), 10u);
    options.sideKnown = false;
    EXPECT_LE(ViewQuery(front, options).distance(back), 3u);  // rounding of levels
}

TEST(ViewSignature, OfNothingIsZero) {
    EXPECT_EQ(viewSignature({}, {0.0, 0.0, 1.0}, 1.0), ViewSignature{});
    const SeenSurface same{{{}, {}, {}, {}, {}}, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}}};
    EXPECT_EQ(viewSignature(same, {0.0, 0.0, 1.0}, 1.0), ViewSignature{});
}

}  // namespace
}  // namespace shapedb
