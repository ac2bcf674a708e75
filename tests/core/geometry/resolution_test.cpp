// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/resolution.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

PointCloud cloud(const Point3& size, const Point3& at, std::size_t count = 500) {
    Random random(5);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back(at + Point3{size.x * (random.uniform() - 0.5), size.y * (random.uniform() - 0.5),
                                     size.z * (random.uniform() - 0.5)});
    }
    return points;
}

PointCloud rounded(PointCloud points) {
    for (Point3& p : points) {
        for (double* c : {&p.x, &p.y, &p.z}) *c = static_cast<double>(static_cast<float>(*c));
    }
    return points;
}

// At 2^22 = 4,194,304 single precision has steps of a half.
TEST(Resolution, AThousandStepsAcrossAreEnough) {
    const auto coarse = [](double x, std::uint64_t points) {
        const Box box{{4194304.0, 0.0, 0.0}, {4194304.0 + x, 300.0, 400.0}};
        return coarseInSinglePrecision(box, points).has_value();
    };
    const double across = 0.5 * kLeastSteps;
    EXPECT_FALSE(coarse(0.0, 100)) << "exactly that many";
    EXPECT_FALSE(coarse(32.0, 100));
    const auto found =
        coarseInSinglePrecision({{4194304.0, 0.0, 0.0}, {4194304.0 + 32.0, 299.0, 399.0}}, 100);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->step, 0.5);
    EXPECT_EQ(found->largest, 4194336.0);
    EXPECT_LT(found->across, across);
    EXPECT_EQ(
        found->text(),
        "coordinates up to 4.19434e+06 are 0.5 apart in single precision, but the scan is only 500 across");
}

TEST(Resolution, MorePointsNeedMoreSteps) {
    const Box box{{4194304.0, 0.0, 0.0}, {4194804.0, 300.0, 400.0}};
    const double steps = 2.0 * std::sqrt(500.0 * 500.0 + 300.0 * 300.0 + 400.0 * 400.0);
    const auto most = static_cast<std::uint64_t>(steps * steps);
    EXPECT_FALSE(coarseInSinglePrecision(box, most));
    EXPECT_TRUE(coarseInSinglePrecision(box, most + 1));
}

TEST(Resolution, AThinSideNeedsItsOwnSteps) {
    const auto coarse = [](double width) {
        return coarseInSinglePrecision({{0.0, 4194304.0, 0.0}, {1e5, 4194304.0 + width, 10.0}}, 100)
            .has_value();
    };
    EXPECT_TRUE(coarse(0.5 * kLeastStepsOfAxis - 0.5)) << "a strip that is a staircase";
    EXPECT_FALSE(coarse(0.5 * kLeastStepsOfAxis));
    EXPECT_FALSE(coarse(0.0)) << "flat, which others say";
    // A plane near the origin with noise of a digit.
    EXPECT_FALSE(coarseInSinglePrecision({{0.0, 0.0, 5.0}, {2.0, 2.0, 5.0 + 0x1p-21}}, 100));
}

TEST(Resolution, DependsOnTheScaleAndNotOnTheUnit) {
    for (const double unit : {1e-30, 1e-3, 1.0, 1e30}) {
        EXPECT_FALSE(coarseInSinglePrecision({{}, unit * Point3{1.0, 2.0, 3.0}}, 1000)) << unit;
        EXPECT_TRUE(
            coarseInSinglePrecision({unit * Point3{1e6, 0.0, 0.0}, unit * Point3{1e6 + 1.0, 2.0, 3.0}}, 9))
            << unit;
        EXPECT_TRUE(isFarFromOrigin({unit * Point3{1e6, 0.0, 0.0}, unit * Point3{1e6 + 1.0, 2.0, 3.0}}));
        EXPECT_FALSE(isFarFromOrigin({unit * Point3{1.0, 0.0, 0.0}, unit * Point3{2.0, 2.0, 3.0}}));
    }
    EXPECT_FALSE(coarseInSinglePrecision({{1e9, 1e9, 1e9}, {1e9, 1e9, 1e9}}, 9)) << "all equal";
    EXPECT_FALSE(isFarFromOrigin({{1e9, 1e9, 1e9}, {1e9, 1e9, 1e9}}));
}

TEST(Resolution, DoublePrecisionHoldsAMillionthUpToTenDigitsOfDistance) {
    const Box box{{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}};
    EXPECT_FALSE(coarseInDoublePrecision(box, {}));
    EXPECT_FALSE(coarseInDoublePrecision(box, {1.7e10, 0.0, 0.0}));
    EXPECT_TRUE(coarseInDoublePrecision(box, {1.8e10, 0.0, 0.0}));
    EXPECT_TRUE(coarseInDoublePrecision(box, {0.0, -1e30, 0.0})) << "all sums are the same number";
}

TEST(Resolution, RoundedPointsAreToldFromOthers) {
    const Point3 far{4.4e6, -5.2e6, 120.0};
    const Point3 size{2.0, 2.0, 2.0};
    EXPECT_TRUE(checkNotRounded(cloud(size, far)));
    EXPECT_TRUE(checkNotRounded(rounded(cloud(size, {1.0, 2.0, 3.0}))));
    EXPECT_TRUE(checkNotRounded(rounded(cloud(1000.0 * size, far)))) << "large enough to keep its shape";
    EXPECT_TRUE(checkNotRounded({}));
    const auto lost = checkNotRounded(rounded(cloud(size, far)));
    ASSERT_FALSE(lost);
    EXPECT_EQ(lost.error().code, ErrorCode::kCoordinateOutOfRange);
    EXPECT_NE(lost.error().message.find("0.5 apart in single precision"), std::string::npos)
        << lost.error().message;
    EXPECT_NE(lost.error().message.find("in double precision"), std::string::npos) << lost.error().message;
    // One digit more says that the others were not rounded either.
    PointCloud mixed = rounded(cloud(size, far));
    mixed.back().x += 0.01;
    EXPECT_TRUE(checkNotRounded(mixed));
}

TEST(Resolution, OutliersDoNotWidenAScan) {
    const PointCloud lost = rounded(cloud({2.0, 2.0, 2.0}, {4.4e6, -5.2e6, 120.0}));
    for (const PointCloud& outliers :
         std::vector<PointCloud>{{{}}, {{}, {}, {1e9, 5.0, 0.0}}, {{3e38, 0.0, 0.0}}}) {
        PointCloud points = lost;
        points.insert(points.begin() + 7, outliers.begin(), outliers.end());
        points = rounded(points);
        const auto found = coarseInSinglePrecision(mainPartOf(points));
        ASSERT_TRUE(found);
        EXPECT_EQ(found->outliers, outliers.size());
        EXPECT_LT(found->across, 4.0);
        EXPECT_FALSE(checkNotRounded(points));
    }
    PointCloud one = lost;
    one.push_back({});
    const std::string text = coarseInSinglePrecision(mainPartOf(one))->text();
    EXPECT_NE(text.find("across, without 1 point far from the others"), std::string::npos) << text;
}

TEST(Resolution, TellsWhatMayHaveBeenFlattened) {
    const auto maybe = [](const Point3& low, const Point3& high) {
        return maybeFlattened({{low, high}, 9, 0});
    };
    EXPECT_TRUE(maybe({4.4e6, 1.0, 2.0}, {4.4e6, 1.0, 2.0})) << "one point";
    EXPECT_FALSE(maybe({}, {})) << "where numbers are as fine as they can be";
    EXPECT_TRUE(maybe({4.4e6, 0.0, 0.0}, {4.4e6, 900.0, 900.0})) << "a plane";
    EXPECT_FALSE(maybe({5.0, 0.0, 0.0}, {5.0, 2.0, 2.0}));
}

TEST(Resolution, PointsOnACoarserGridLostNothing) {
    PointCloud voxels;
    for (int i = 0; i < 1000; ++i) {
        voxels.push_back({4.4e6 + i % 10, 5.0e6 + i / 10 % 10, static_cast<double>(i / 100)});
    }
    EXPECT_TRUE(checkNotRounded(voxels)) << "whole numbers where single precision has halves";
    for (Point3& p : voxels) p = p + Point3{1e8, 0.0, 0.0};
    EXPECT_TRUE(checkNotRounded(voxels)) << "not in single precision";
    EXPECT_FALSE(checkNotRounded(rounded(voxels)));
}

TEST(Resolution, LeavesOtherFaultsToOthers) {
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {std::nan(""), infinity, -1e300}) {
        PointCloud points = rounded(cloud({2.0, 2.0, 2.0}, {4.4e6, 0.0, 0.0}));
        points[3].y = bad;
        EXPECT_TRUE(checkNotRounded(points)) << bad;
    }
}

}  // namespace
}  // namespace shapedb
