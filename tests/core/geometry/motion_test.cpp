// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"

namespace shapedb {
namespace {

void expectNear(const Point3& a, const Point3& b, double tolerance) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

Point3 randomPoint(Random& random) {
    return {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
}

Motion randomMotion(Random& random) {
    Motion motion;
    motion.scale = std::exp(random.uniform(-2, 2));
    motion.reflected = random.below(2) == 1;
    motion.rotation = randomRotation(random);
    if (motion.reflected) {
        for (auto& row : motion.rotation) row[0] = -row[0];
    }
    motion.translation = randomPoint(random);
    return motion;
}

TEST(Motion, DefaultIsTheIdentity) {
    const Point3 p{1.5, -2.5, 3.5};
    EXPECT_EQ(apply(Motion{}, p), p);
    EXPECT_EQ(determinant(Motion{}.rotation), 1.0);
}

TEST(Motion, AppliesAKnownQuarterTurn) {
    Motion motion;  // a quarter turn about z, doubled, moved: x -> y, y -> -x
    motion.scale = 2.0;
    motion.rotation = {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}};
    motion.translation = {10, 20, 30};
    EXPECT_EQ(apply(motion, Point3{1, 0, 0}), (Point3{10, 22, 30}));
    EXPECT_EQ(apply(motion, Point3{0, 1, 0}), (Point3{8, 20, 30}));
    EXPECT_EQ(apply(motion, Point3{0, 0, 1}), (Point3{10, 20, 32}));
}

TEST(Motion, ScalesEveryDistanceByItsScale) {
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const Motion motion = randomMotion(random);
        const Point3 a = randomPoint(random);
        const Point3 b = randomPoint(random);
        EXPECT_NEAR(distance(apply(motion, a), apply(motion, b)), motion.scale * distance(a, b), 1e-10);
    }
}

TEST(Motion, InverseUndoesTheMotionFromBothSides) {
    Random random(2);
    for (int i = 0; i < 200; ++i) {
        const Motion motion = randomMotion(random);
        const Point3 p = randomPoint(random);
        const Motion back = inverse(motion);
        EXPECT_EQ(back.reflected, motion.reflected);
        expectNear(apply(back, apply(motion, p)), p, 1e-10);
        expectNear(apply(motion, apply(back, p)), p, 1e-10);
    }
}

TEST(Motion, ComposeAppliesOneAfterTheOther) {
    Random random(3);
    for (int i = 0; i < 200; ++i) {
        const Motion first = randomMotion(random);
        const Motion second = randomMotion(random);
        const Motion both = compose(second, first);
        const Point3 p = randomPoint(random);
        expectNear(apply(both, p), apply(second, apply(first, p)), 1e-9);
        EXPECT_NEAR(determinant(both.rotation), both.reflected ? -1.0 : 1.0, 1e-12);
    }
}

TEST(Motion, MovesACloudPointByPoint) {
    Random random(4);
    const Motion motion = randomMotion(random);
    PointCloud points;
    for (int i = 0; i < 10; ++i) points.push_back(randomPoint(random));
    const PointCloud moved = applyToCloud(motion, points);
    ASSERT_EQ(moved.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(moved[i], apply(motion, points[i]));
}

TEST(Motion, EveryDirectionHasAUnitVectorPerpendicularToIt) {
    Random random(11);
    std::vector<Point3> directions = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1e-9},
                                      {1, 1, 1}, {1, 1, 0},  {-1e9, 0, 1}};
    for (int i = 0; i < 100; ++i) directions.push_back(3.0 * randomDirection(random));
    for (const Point3& direction : directions) {
        const Point3 across = anyPerpendicular(direction);
        EXPECT_NEAR(length(across), 1.0, 1e-12);
        EXPECT_NEAR(dot(across, direction) / length(direction), 0.0, 1e-12);
    }
}

TEST(Motion, RandomRotationIsOrthonormalWithDeterminantOne) {
    Random random(5);
    for (int i = 0; i < 500; ++i) {
        const Matrix3 r = randomRotation(random);
        EXPECT_NEAR(determinant(r), 1.0, 1e-14);
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b) {
                const double product = r[a][0] * r[b][0] + r[a][1] * r[b][1] + r[a][2] * r[b][2];
                EXPECT_NEAR(product, a == b ? 1.0 : 0.0, 1e-14);
            }
        }
    }
}

// Uniform on SO(3) means: every fixed direction lands uniformly on the sphere, so each of its
// coordinates is uniform in [-1, 1] (Archimedes), and the angle t of the rotation has the
// distribution function (t - sin t) / pi. Kolmogorov-Smirnov at the 0.1 % level.
TEST(Motion, RandomRotationIsUniform) {
    constexpr int kDraws = 20000;
    constexpr int kCells = 200;
    Random random(6);
    std::array<std::array<int, kCells>, 9> entry{};
    std::array<int, kCells> angle{};
    for (int i = 0; i < kDraws; ++i) {
        const Matrix3 r = randomRotation(random);
        for (std::size_t k = 0; k < 9; ++k) {
            const double u = (r[k / 3][k % 3] + 1.0) / 2.0;
            ++entry[k][static_cast<std::size_t>(std::min(kCells - 1.0, u * kCells))];
        }
        const double cosine = std::min(1.0, std::max(-1.0, (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0));
        const double t = std::acos(cosine);
        const double u = (t - std::sin(t)) / kPi;
        ++angle[static_cast<std::size_t>(std::min(kCells - 1.0, u * kCells))];
    }
    const auto largestGap = [](const std::array<int, kCells>& counts) {
        double sum = 0.0;
        double gap = 0.0;
        for (std::size_t i = 0; i < kCells; ++i) {
            sum += counts[i];
            gap = std::max(gap, std::abs(sum / kDraws - (static_cast<double>(i) + 1.0) / kCells));
        }
        return gap;
    };
    const double limit = 1.95 / std::sqrt(static_cast<double>(kDraws));
    for (const auto& counts : entry) EXPECT_LT(largestGap(counts), limit);
    EXPECT_LT(largestGap(angle), limit);
}

}  // namespace
}  // namespace shapedb
