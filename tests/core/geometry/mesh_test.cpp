// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/mesh.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

// Two triangles in different planes, the second with nine times the area of the first.
TriangleMesh unequalPair() {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 10}, {3, 0, 10}, {0, 3, 10}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    return mesh;
}

TEST(SampleSurface, PointsLieOnTheTriangles) {
    const auto points = sampleSurface(unequalPair(), 5000, 1);
    ASSERT_TRUE(points);
    ASSERT_EQ(points->size(), 5000U);
    for (const Point3& p : *points) {
        const double side = p.z < 5.0 ? 1.0 : 3.0;
        EXPECT_NEAR(p.z, p.z < 5.0 ? 0.0 : 10.0, 1e-12);
        EXPECT_GE(p.x, -1e-12);
        EXPECT_GE(p.y, -1e-12);
        EXPECT_LE(p.x + p.y, side + 1e-12);
    }
}

TEST(SampleSurface, SamplesTrianglesByArea) {
    constexpr std::size_t kCount = 40000;
    const auto points = sampleSurface(unequalPair(), kCount, 2);
    ASSERT_TRUE(points);
    double onSmall = 0.0;
    for (const Point3& p : *points) onSmall += p.z < 5.0 ? 1.0 : 0.0;
    const double deviation = std::sqrt(kCount * 0.1 * 0.9);
    EXPECT_NEAR(onSmall, 0.1 * kCount, 5.0 * deviation);
}

// Cut a right triangle into its four congruent quarters: each gets a quarter of the points.
TEST(SampleSurface, IsUniformWithinATriangle) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
    mesh.triangles = {{0, 1, 2}};
    constexpr std::size_t kCount = 40000;
    const auto points = sampleSurface(mesh, kCount, 3);
    ASSERT_TRUE(points);
    double quarter[4] = {0, 0, 0, 0};
    for (const Point3& p : *points) {
        if (p.x > 1.0) {
            ++quarter[0];
        } else if (p.y > 1.0) {
            ++quarter[1];
        } else {
            ++quarter[p.x + p.y < 1.0 ? 2 : 3];
        }
    }
    const double deviation = std::sqrt(kCount * 0.25 * 0.75);
    for (const double n : quarter) EXPECT_NEAR(n, 0.25 * kCount, 5.0 * deviation);
}

TEST(SampleSurface, IsReproducibleBySeed) {
    const auto a = sampleSurface(unequalPair(), 100, 7);
    const auto b = sampleSurface(unequalPair(), 100, 7);
    const auto c = sampleSurface(unequalPair(), 100, 8);
    ASSERT_TRUE(a && b && c);
    EXPECT_EQ(*a, *b);
    EXPECT_NE(*a, *c);
}

TEST(SampleSurface, TrianglesWithoutAreaGetNoPoints) {
    TriangleMesh mesh = unequalPair();
    mesh.triangles = {{0, 0, 1}, {3, 4, 5}, {1, 1, 1}};
    const auto points = sampleSurface(mesh, 1000, 4);
    ASSERT_TRUE(points);
    for (const Point3& p : *points) EXPECT_NEAR(p.z, 10.0, 1e-12);
}

TEST(SampleSurface, RefusesZeroPoints) {
    const auto points = sampleSurface(unequalPair(), 0, 1);
    ASSERT_FALSE(points);
    EXPECT_EQ(points.error().code, ErrorCode::kInvalidArgument);
}

TEST(SampleSurface, RefusesAVertexThatDoesNotExist) {
    TriangleMesh mesh = unequalPair();
    mesh.triangles.push_back({0, 1, 6});
    const auto points = sampleSurface(mesh, 10, 1);
    ASSERT_FALSE(points);
    EXPECT_EQ(points.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(points.error().message.find("triangle 2"), std::string::npos);
}

TEST(SampleSurface, RefusesANonFiniteVertexButOnlyIfUsed) {
    TriangleMesh mesh = unequalPair();
    mesh.vertices.push_back({0.0, std::numeric_limits<double>::quiet_NaN(), 0.0});
    EXPECT_TRUE(sampleSurface(mesh, 10, 1));
    mesh.triangles.push_back({0, 1, 6});
    const auto points = sampleSurface(mesh, 10, 1);
    ASSERT_FALSE(points);
    EXPECT_EQ(points.error().code, ErrorCode::kNonFiniteCoordinate);
    EXPECT_NE(points.error().message.find("vertex 6"), std::string::npos);
}

TEST(SampleSurface, RefusesAMeshWithoutArea) {
    TriangleMesh mesh = unequalPair();
    mesh.triangles = {{0, 0, 1}};
    EXPECT_EQ(sampleSurface(mesh, 10, 1).error().code, ErrorCode::kMalformedFile);
    mesh.triangles.clear();
    EXPECT_EQ(sampleSurface(mesh, 10, 1).error().code, ErrorCode::kMalformedFile);
}

}  // namespace
}  // namespace shapedb
