// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/interior.h"

#include <atomic>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/geometry/neighbours.h"
#include "tests/core/segmentation/exact_balls.h"

namespace shapedb {
namespace {

// Exact centre and squared radius of every ball.
struct Balls {
    explicit Balls(const Triangulated& cloud) {
        for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            centres.push_back(exactCentre(cloud, t));
            squaredRadii.push_back(CGAL::squared_distance(centres.back(), exactCorners(cloud, t)[0]));
        }
    }
    std::vector<ExactPoint> centres;
    std::vector<ExactNumber> squaredRadii;
};

// Radians, by the law of cosines, rational up to the square root. Near 0 the arc cosine loses half the
// digits, which the tests allow for.
double lawOfCosines(const Balls& balls, std::size_t s, std::size_t t) {
    const ExactNumber numerator = balls.squaredRadii[s] + balls.squaredRadii[t] -
                                  CGAL::squared_distance(balls.centres[s], balls.centres[t]);
    const double cosine =
        CGAL::to_double(numerator) / (2.0 * std::sqrt(CGAL::to_double(balls.squaredRadii[s])) *
                                      std::sqrt(CGAL::to_double(balls.squaredRadii[t])));
    return std::acos(std::max(-1.0, std::min(1.0, cosine)));
}

// Whether the walk enters through a hull facet, literally: the ball flows outwards through it, and
// asin(radius of the facet / radius of the ball) is below the limit.
bool opens(const Triangulated& cloud, const Balls& balls, std::size_t t, std::size_t facet, double limit) {
    const auto p = exactCorners(cloud, t);
    const auto& a = p[(facet + 1) % 4];
    const auto& b = p[(facet + 2) % 4];
    const auto& c = p[(facet + 3) % 4];
    if (CGAL::orientation(a, b, c, balls.centres[t]) != -CGAL::orientation(a, b, c, p[facet])) return false;
    const double ratio =
        std::sqrt(CGAL::to_double(CGAL::squared_radius(a, b, c)) / CGAL::to_double(balls.squaredRadii[t]));
    return std::asin(std::min(1.0, ratio)) < limit;
}

// The walk as a fixpoint: repeat over all pairs until nothing changes.
std::vector<std::uint8_t> referenceInterior(const Triangulated& cloud, const Balls& balls,
                                            const std::vector<std::uint8_t>& big, double deep, double hull) {
    const auto& neighbours = cloud.tetrahedra.neighbours;
    std::vector<std::uint8_t> outside(big.size(), 0);
    std::vector<std::uint32_t> reached;
    for (std::uint32_t t = 0; t < big.size(); ++t) {
        for (std::size_t i = 0; i < 4 && !outside[t]; ++i) {
            if (big[t] && neighbours[t][i] == kNoTetrahedron && opens(cloud, balls, t, i, hull)) {
                outside[t] = 1;
                reached.push_back(t);
            }
        }
    }
    while (!reached.empty()) {
        const std::uint32_t t = reached.back();
        reached.pop_back();
        for (const std::uint32_t next : neighbours[t]) {
            if (next == kNoTetrahedron || outside[next] || !big[next]) continue;
            if (lawOfCosines(balls, t, next) >= deep) continue;
            outside[next] = 1;
            reached.push_back(next);
        }
    }
    std::vector<std::uint8_t> inside(big.size());
    for (std::size_t t = 0; t < big.size(); ++t) inside[t] = big[t] && !outside[t];
    return inside;
}

std::vector<std::uint8_t> bigOf(const Triangulated& cloud, double ratio) {
    return bigBalls(cloud.tetrahedra, localSpacings(cloud.points).value(), ratio);
}

std::size_t countOf(const std::vector<std::uint8_t>& flags) {
    return std::accumulate(flags.begin(), flags.end(), std::size_t{0});
}

TEST(BigBalls, ExceedTheSpacingOfAnyCorner) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto spacings = localSpacings(cloud.points).value();
        for (const double ratio : {0.3, 0.5, 1.0, 2.0}) {
            const auto big = bigBalls(cloud.tetrahedra, spacings, ratio);
            for (std::size_t t = 0; t < big.size(); ++t) {
                bool expected = false;
                for (const std::uint32_t v : cloud.tetrahedra.vertices[t]) {
                    expected = expected || cloud.tetrahedra.circumradii[t] > ratio * spacings[v];
                }
                ASSERT_EQ(big[t] != 0, expected) << cloud.name;
            }
        }
    }
}

TEST(BigBalls, AreFewerForALargerRatio) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        EXPECT_GE(countOf(bigOf(cloud, 0.5)), countOf(bigOf(cloud, 1.0))) << cloud.name;
        EXPECT_EQ(countOf(bigOf(cloud, 1e-9)), cloud.tetrahedra.size()) << cloud.name;
    }
}

TEST(IntersectionAngle, IsKnownForSimplePositions) {
    // Two unit spheres through the origin, centres on the axes: they meet at a right angle.
    EXPECT_DOUBLE_EQ(intersectionAngle({1, 0, 0}, {0, 1, 0}, {0, 0, 0}), kPi / 2);
    EXPECT_DOUBLE_EQ(intersectionAngle({1, 0, 0}, {-1, 0, 0}, {0, 0, 0}), kPi);
    EXPECT_DOUBLE_EQ(intersectionAngle({1, 0, 0}, {5, 0, 0}, {0, 0, 0}), 0.0);
    EXPECT_DOUBLE_EQ(intersectionAngle({1, 2, 3}, {1, 2, 3}, {0, 2, 3}), 0.0);
    // A huge ball is a half space: the angle is that between its normal and the radius.
    EXPECT_NEAR(intersectionAngle({0, 0, 1e12}, {1, 0, 1}, {0, 0, 0}), kPi / 4, 1e-11);
}

TEST(IntersectionAngle, AgreesWithTheLawOfCosines) {
    std::size_t compared = 0;
    for (const Triangulated& cloud : triangulatedClouds()) {
        if (cloud.name == "flat" || cloud.name == "tiny grid in a large frame") continue;  // see below
        const Balls balls(cloud);
        for (std::uint32_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            for (std::size_t i = 0; i < 4; ++i) {
                const std::uint32_t next = cloud.tetrahedra.neighbours[t][i];
                if (next == kNoTetrahedron || next < t) continue;
                const double expected = lawOfCosines(balls, t, next);
                for (std::size_t k = 1; k < 4; ++k) {
                    const Point3& shared = cloud.points[cloud.tetrahedra.vertices[t][(i + k) % 4]];
                    ASSERT_NEAR(intersectionAngle(cloud.tetrahedra.circumcentres[t],
                                                  cloud.tetrahedra.circumcentres[next], shared),
                                expected, 1e-6)
                        << cloud.name;
                }
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 10000U);
}

// Walk and reference may differ where an angle is within rounding of its limit, so the walk must lie between
// the references for a slightly smaller and a slightly larger angle.
TEST(InteriorTetrahedra, AreTheFixpointOfTheWalk) {
    std::size_t sharp = 0;
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Balls balls(cloud);
        for (const double degrees : {10.0, 30.0}) {
            SegmentationOptions options;
            options.deepAngleDegrees = degrees;
            const auto big = bigOf(cloud, options.bigBallRatio);
            const auto inside = interiorTetrahedra(cloud.points, cloud.tetrahedra, big, options).value();
            const double hull = toRadians(options.hullAngleDegrees);
            const auto most = referenceInterior(cloud, balls, big, toRadians(degrees) - 1e-5, hull - 1e-7);
            const auto least = referenceInterior(cloud, balls, big, toRadians(degrees) + 1e-5, hull + 1e-7);
            ASSERT_EQ(inside.size(), big.size());
            for (std::size_t t = 0; t < inside.size(); ++t) {
                ASSERT_LE(inside[t], most[t]) << cloud.name << " at " << degrees;
                ASSERT_GE(inside[t], least[t]) << cloud.name << " at " << degrees;
            }
            sharp += most == least;
        }
    }
    EXPECT_GT(sharp, triangulatedClouds().size()) << "the references must pin the result down";
}

TEST(InteriorTetrahedra, AreFewerForALargerAngle) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        SegmentationOptions options;
        const std::vector<std::uint8_t> none(cloud.tetrahedra.size(), 0);
        EXPECT_EQ(countOf(*interiorTetrahedra(cloud.points, cloud.tetrahedra, none, options)), 0U);
        const auto big = bigOf(cloud, options.bigBallRatio);
        std::size_t last = cloud.tetrahedra.size();
        for (const double degrees : {5.0, 15.0, 25.0, 60.0, 89.0}) {
            options.deepAngleDegrees = degrees;
            const std::size_t count =
                countOf(*interiorTetrahedra(cloud.points, cloud.tetrahedra, big, options));
            EXPECT_LE(count, last) << cloud.name;
            last = count;
        }
    }
}

TEST(InteriorTetrahedra, CanBeCancelled) {
    // Enough tetrahedra for the walk to reach a checkpoint.
    Random random(3);
    PointCloud points;
    for (int i = 0; i < 20000; ++i) points.push_back({random.uniform(), random.uniform(), random.uniform()});
    const auto flat = triangulate(points).value();
    SegmentationOptions options;
    options.deepAngleDegrees = 89.0;
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto result =
        interiorTetrahedra(points, flat, std::vector<std::uint8_t>(flat.size(), 1), options, context);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
