// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/sanitise.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/geometry/random_points.h"

namespace shapedb {
namespace {

PointCloud randomPoints(std::size_t count, std::uint64_t seed) {
    return testing_support::randomPoints(count, seed, {-1, 2, -9}, {5, 3, 0});
}

TEST(Sanitise, SortsPointsInTheUnitFrame) {
    const PointCloud scan = randomPoints(1000, 1);
    const auto clean = sanitise(scan);
    ASSERT_TRUE(clean);
    EXPECT_EQ(clean->duplicates, 0U);
    EXPECT_TRUE(std::is_sorted(clean->points.begin(), clean->points.end(), lexicographicLess));
    double most = 0.0;
    for (const Point3& p : clean->points) {
        most = std::max({most, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        for (const double v : {p.x, p.y, p.z}) EXPECT_EQ(std::remainder(v, kGrid), 0.0);
    }
    EXPECT_LE(most, 1.0);
    EXPECT_GE(most, 0.5);
    int exponent = 0;
    EXPECT_EQ(std::frexp(clean->frame.unit, &exponent), 0.5) << "a power of two";
    for (std::size_t i = 0; i < scan.size(); ++i) {
        EXPECT_LT(distance(clean->frame.toScan(clean->points[clean->siteOfPoint[i]]), scan[i]), 1e-14);
    }
}

TEST(Sanitise, MergesAndCountsDuplicates) {
    PointCloud scan = randomPoints(50, 2);
    scan.push_back(scan[7]);
    scan.push_back(scan[7]);
    scan.push_back(scan[20]);
    scan[30].z = 0.0;
    scan.push_back({scan[30].x, scan[30].y, -0.0});
    const auto clean = sanitise(scan);
    ASSERT_TRUE(clean);
    EXPECT_EQ(clean->duplicates, 4U) << "zero has one sign";
    EXPECT_EQ(clean->points.size(), 50U);
    EXPECT_EQ(clean->siteOfPoint[50], clean->siteOfPoint[7]);
    EXPECT_EQ(clean->siteOfPoint[51], clean->siteOfPoint[7]);
    EXPECT_EQ(clean->siteOfPoint[52], clean->siteOfPoint[20]);
    EXPECT_EQ(clean->siteOfPoint[53], clean->siteOfPoint[30]);
    const std::set<std::uint32_t> sites(clean->siteOfPoint.begin(), clean->siteOfPoint.end());
    EXPECT_EQ(sites.size(), 50U);
}

TEST(Sanitise, DoesNotDependOnOrderOrPowersOfTwo) {
    const PointCloud scan = randomPoints(300, 3);
    const auto clean = sanitise(scan);
    PointCloud changed(scan.rbegin(), scan.rend());
    for (Point3& p : changed) p = 0x1p-77 * p;
    const auto other = sanitise(changed);
    ASSERT_TRUE(clean && other);
    ASSERT_EQ(clean->points.size(), other->points.size());
    EXPECT_EQ(std::memcmp(clean->points.data(), other->points.data(), 300 * sizeof(Point3)), 0);
    EXPECT_EQ(other->frame.unit, 0x1p-77 * clean->frame.unit);
}

TEST(Sanitise, WorksAtTheEndsOfTheRange) {
    PointCloud scan = randomPoints(100, 4);
    PointCloud huge = scan;
    PointCloud tiny = scan;
    for (Point3& p : huge) p = 3.7e37 * p;
    for (Point3& p : tiny) p = 1e-36 * p;
    for (const PointCloud* points : {&huge, &tiny}) {
        const auto clean = sanitise(*points);
        ASSERT_TRUE(clean) << clean.error().message;
        EXPECT_EQ(clean->points.size(), 100U);
    }
}

TEST(Sanitise, NamesTheFirstBadCoordinate) {
    const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity(), 1e300, -3.5e38};
    for (const double value : bad) {
        for (int axis = 0; axis < 3; ++axis) {
            PointCloud scan = randomPoints(20, 5);
            double* coordinates[] = {&scan[11].x, &scan[11].y, &scan[11].z};
            *coordinates[axis] = value;
            scan[15].x = std::nan("");
            const auto result = sanitise(scan);
            ASSERT_FALSE(result);
            EXPECT_EQ(result.error().code, std::abs(value) < 1e301 ? ErrorCode::kCoordinateOutOfRange
                                                                   : ErrorCode::kNonFiniteCoordinate);
            const std::string where = std::string("coordinate ") + "xyz"[axis] + " of point 11 ";
            EXPECT_NE(result.error().message.find(where), std::string::npos) << result.error().message;
        }
    }
}

TEST(Sanitise, RefusesScansWithoutVolume) {
    EXPECT_EQ(sanitise({}).error().code, ErrorCode::kTooFewPoints);
    EXPECT_EQ(sanitise(randomPoints(3, 1)).error().code, ErrorCode::kTooFewPoints);
    EXPECT_EQ(sanitise(PointCloud(9, {1, 2, 3})).error().code, ErrorCode::kAllPointsEqual);
    PointCloud three = randomPoints(3, 1);
    three.push_back(three[0]);
    EXPECT_EQ(sanitise(three).error().code, ErrorCode::kTooFewPoints);
    PointCloud small = randomPoints(10, 1);
    for (Point3& p : small) p = 1e-300 * p;
    EXPECT_EQ(sanitise(small).error().code, ErrorCode::kCoordinateOutOfRange);
}

// Just under and just over the tolerance, in any direction.
TEST(Sanitise, FlatnessHasATolerance) {
    Random random(6);
    for (const double height : {0.0, 0.4e-6, 4e-6}) {
        PointCloud plane;
        PointCloud line;
        for (int i = 0; i < 200; ++i) {
            const double x = random.uniform(-1, 1);
            plane.push_back({x, random.uniform(-1, 1), i % 2 == 0 ? height : 0.0});
            line.push_back({x, i % 2 == 0 ? height : 0.0, i % 3 == 0 ? height : 0.0});
        }
        const auto flat = sanitise(plane);
        const auto thin = sanitise(line);
        if (height < 1e-6) {
            ASSERT_FALSE(flat);
            ASSERT_FALSE(thin);
            EXPECT_EQ(flat.error().code, ErrorCode::kCoplanar);
            EXPECT_EQ(thin.error().code, ErrorCode::kCollinear);
        } else {
            EXPECT_TRUE(flat);
            EXPECT_TRUE(thin);
        }
    }
}

}  // namespace
}  // namespace shapedb
