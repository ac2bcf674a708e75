// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/main_part.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

PointCloud cube(std::size_t count, const Point3& at, double size = 2.0) {
    Random random(3);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back(
            at + size * Point3{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5});
    }
    return points;
}

TEST(MainPart, OutliersDoNotBelongToIt) {
    const Point3 at{4.4e6, -5.2e6, 120.0};
    const std::vector<PointCloud> ofOutliers = {{{}},
                                                {{}, {}, {}},
                                                {{1e9, 0.0, 0.0}},
                                                {{}, {-1e9, 1e9, 3e38}},
                                                {{4.4e6 + 100.0, -5.2e6, 120.0}},
                                                cube(20, {}, 1e7)};
    for (const std::size_t count : {100u, 1'000u, 200'000u}) {
        const PointCloud points = cube(count, at);
        for (const PointCloud& outliers : ofOutliers) {
            for (const bool first : {true, false}) {
                PointCloud all = points;
                all.insert(first ? all.begin() : all.end(), outliers.begin(), outliers.end());
                const MainPart part = mainPartOf(all);
                EXPECT_EQ(part.outliers, outliers.size()) << count;
                EXPECT_EQ(part.points, count);
                EXPECT_EQ(part.box.low, boxOf(points).low);
                EXPECT_EQ(part.box.high, boxOf(points).high);
            }
        }
    }
}

TEST(MainPart, IsTheWholeOfUsualScans) {
    PointCloud jack;  // six arms that end in balls: most of each coordinate is about 0
    for (const double end : {-2.4, 2.4}) {
        for (const Point3& at : {Point3{end, 0.0, 0.0}, Point3{0.0, end, 0.0}, Point3{0.0, 0.0, end}}) {
            const PointCloud ball = cube(100, at, 1e-3);
            jack.insert(jack.end(), ball.begin(), ball.end());
        }
    }
    PointCloud rod;
    for (int i = 0; i < 1'000; ++i) rod.push_back({0.1 * i, 5.0, 7.0});
    PointCloud unseen(600, Point3{});  // of a depth camera that saw little
    const PointCloud seen = cube(400, {0.0, 0.0, 3.0});
    unseen.insert(unseen.end(), seen.begin(), seen.end());
    const PointCloud four = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const PointCloud& scan :
         {cube(1'000, {5.0, 6.0, 7.0}), jack, rod, unseen, four, PointCloud{{1, 2, 3}}}) {
        const MainPart part = mainPartOf(scan);
        EXPECT_EQ(part.outliers, 0u);
        EXPECT_EQ(part.points, scan.size());
        EXPECT_EQ(part.box.high, boxOf(scan).high);
    }
}

TEST(MainPart, MayBeOnePoint) {
    PointCloud points(1'000, Point3{1.0, 2.0, 3.0});
    EXPECT_TRUE(mainPartOf(points).isPoint());
    EXPECT_EQ(mainPartOf(points).outliers, 0u);
    points.push_back({});
    EXPECT_TRUE(mainPartOf(points).isPoint());
    EXPECT_EQ(mainPartOf(points).outliers, 1u);
}

TEST(MainPart, HoldsTheLargestAndSmallestNumbers) {
    EXPECT_EQ(mainPartOf(PointCloud{{-3.4e38, 0, 0}, {3.4e38, 0, 0}, {0, 3.4e38, 0}, {0, 0, 1}}).outliers,
              0u);
    EXPECT_EQ(mainPartOf(cube(100, {}, 1e-300)).outliers, 0u);
}

}  // namespace
}  // namespace shapedb
