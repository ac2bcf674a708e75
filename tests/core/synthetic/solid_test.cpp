// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/solid.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/synthetic/parts.h"

namespace shapedb {
namespace {

// Expects that `in` holds for a share `expected` of the points, within five standard deviations.
void expectShare(const PointCloud& points, const std::function<bool(const Point3&)>& in, double expected) {
    const double n = static_cast<double>(points.size());
    const double found = static_cast<double>(std::count_if(points.begin(), points.end(), in)) / n;
    EXPECT_NEAR(found, expected, 5.0 * std::sqrt(expected * (1.0 - expected) / n));
}

Solid movedSolid(const Motion& motion, const Solid& solid) {
    Solid moved = solid;
    for (SolidPart& part : moved.parts) part.placement = compose(motion, part.placement);
    return moved;
}

PointCloud sample(const Solid& solid, std::size_t count = 40000, std::uint64_t seed = 1) {
    const auto points = sampleBoundary(solid, count, seed);
    EXPECT_TRUE(points) << (points ? "" : points.error().message);
    return points ? *points : PointCloud{};
}

Motion someMotion(std::uint64_t seed) {
    Random random(seed);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = random.uniform(0.2, 5.0);
    motion.reflected = random.below(2) == 1;
    if (motion.reflected) {
        for (auto& row : motion.rotation) row[1] = -row[1];
    }
    motion.translation = {random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(-9, 9)};
    return motion;
}

std::vector<Solid> onePrimitiveEach() {
    return {{{ball({0.1, 0.2, 0.3}, 0.7)}},
            {{ellipsoid({}, {1.0, 0.5, 0.2})}},
            {{rod({0, 0, -1}, {1, 2, 1}, 0.4)}},
            {{cylinder({0, 0, -1}, {1, 2, 1}, 0.4)}},
            {{cylinder({0, 0, -1}, {1, 2, 1}, 0.4, 0.25)}},
            {{block({1, 1, 1}, {0.3, 0.6, 0.9}, rotationAboutX(0.4))}},
            {{ring({}, {1, 1, 0}, 1.0, 0.3)}}};
}

TEST(Solid, SamplesLieOnTheBoundary) {
    for (const Solid& solid : onePrimitiveEach()) {
        for (const Point3& p : sample(solid, 2000)) {
            EXPECT_NEAR(implicitValue(solid.parts[0], p), 0.0, 1e-12)
                << "shape " << solid.parts[0].shape.index();
        }
    }
}

TEST(Solid, BoundsAreTight) {
    for (const Solid& still : onePrimitiveEach()) {
        const Solid solid = movedSolid(someMotion(still.parts[0].shape.index()), still);
        const Box bounds = boundsOf(solid);
        Point3 low = bounds.high;
        Point3 high = bounds.low;
        for (const Point3& p : sample(solid)) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        const double size = bounds.diagonal();
        for (const double gap : {low.x - bounds.low.x, low.y - bounds.low.y, low.z - bounds.low.z,
                                 bounds.high.x - high.x, bounds.high.y - high.y, bounds.high.z - high.z}) {
            EXPECT_GE(gap, -1e-12 * size) << "shape " << solid.parts[0].shape.index();
            EXPECT_LT(gap, 0.02 * size) << "shape " << solid.parts[0].shape.index();
        }
    }
}

// Archimedes: a zone of a sphere has an area proportional to its height.
TEST(Solid, SamplesASphereUniformly) {
    const PointCloud points = sample({{ball({}, 2.0)}});
    for (const double height : {-1.5, 0.0, 1.0}) {
        expectShare(
            points, [&](const Point3& p) { return p.x < height; }, (height + 2.0) / 4.0);
        expectShare(
            points, [&](const Point3& p) { return p.z < height; }, (height + 2.0) / 4.0);
    }
}

TEST(Solid, SamplesCylindersCapsulesAndPipesByArea) {
    const double r = 0.5;
    const double h = 1.5;
    const double inner = 0.2;
    expectShare(
        sample({{cylinder({0, 0, -h}, {0, 0, h}, r)}}),
        [&](const Point3& p) { return std::abs(p.z) > h - 1e-9; }, 2 * r * r / (2 * r * r + 4 * r * h));
    expectShare(
        sample({{rod({0, 0, -h}, {0, 0, h}, r)}}), [&](const Point3& p) { return p.z > h; },
        0.5 * r / (r + h));
    const PointCloud pipe = sample({{cylinder({0, 0, -h}, {0, 0, h}, r, inner)}});
    const double ends = 2.0 * (r * r - inner * inner);
    const double total = ends + 4.0 * (r + inner) * h;
    expectShare(
        pipe, [&](const Point3& p) { return std::hypot(p.x, p.y) < inner + 1e-9; }, 4.0 * inner * h / total);
    expectShare(
        pipe, [&](const Point3& p) { return std::abs(p.z) > h - 1e-9; }, ends / total);
    // Half the area of a flat end lies inside this radius.
    PointCloud end;
    std::copy_if(pipe.begin(), pipe.end(), std::back_inserter(end),
                 [&](const Point3& p) { return p.z > h - 1e-9; });
    const double half = std::sqrt(0.5 * (r * r + inner * inner));
    expectShare(
        end, [&](const Point3& p) { return std::hypot(p.x, p.y) < half; }, 0.5);
}

TEST(Solid, SamplesBoxFacesByArea) {
    const PointCloud points = sample({{block({}, {1.0, 2.0, 3.0})}});
    const double total = 2.0 * 3.0 + 3.0 * 1.0 + 1.0 * 2.0;
    expectShare(
        points, [](const Point3& p) { return p.x > 1.0 - 1e-9; }, 0.5 * 6.0 / total);
    expectShare(
        points, [](const Point3& p) { return p.y < -2.0 + 1e-9; }, 0.5 * 3.0 / total);
    expectShare(
        points, [](const Point3& p) { return std::abs(p.z) > 3.0 - 1e-9; }, 2.0 / total);
}

// The outer half of a torus has area 2 pi r (pi R + 2 r) of 4 pi^2 R r.
TEST(Solid, SamplesATorusUniformly) {
    const double ringRadius = 1.0;
    const double tube = 0.5;
    expectShare(
        sample({{ring({}, {0, 0, 1}, ringRadius, tube)}}),
        [&](const Point3& p) { return std::hypot(p.x, p.y) > ringRadius; },
        (kPi * ringRadius + 2.0 * tube) / (2.0 * kPi * ringRadius));
}

// The zone |z| < t of the spheroid (1, 1, c), c < 1, has an area proportional to
// t sqrt(1 + k t^2) + asinh(sqrt(k) t) / sqrt(k) with k = (1 - c^2) / c^4.
TEST(Solid, SamplesAnEllipsoidUniformly) {
    const double c = 0.3;
    const double k = (1.0 - c * c) / std::pow(c, 4);
    const auto zone = [&](double t) {
        return t * std::sqrt(1.0 + k * t * t) + std::asinh(std::sqrt(k) * t) / std::sqrt(k);
    };
    const PointCloud points = sample({{ellipsoid({}, {1.0, 1.0, c})}});
    for (const double t : {0.05, 0.1, 0.2, 0.28}) {
        expectShare(
            points, [&](const Point3& p) { return std::abs(p.z) < t; }, zone(t) / zone(c));
    }
    // The order of the axes must not matter.
    const PointCloud other = sample({{ellipsoid({}, {c, 1.0, 1.0})}});
    expectShare(
        other, [&](const Point3& p) { return std::abs(p.x) < 0.1; }, zone(0.1) / zone(c));
}

TEST(Solid, OmitsHiddenSurfaces) {
    // Two unit balls at distance 1: each loses the cap of height 1/2, a quarter of its area.
    const Solid solid{{ball({-0.5, 0, 0}, 1.0), ball({0.5, 0, 0}, 1.0)}};
    const PointCloud points = sample(solid);
    for (const Point3& p : points) {
        EXPECT_GE(std::min(implicitValue(solid.parts[0], p), implicitValue(solid.parts[1], p)), -1e-12);
    }
    expectShare(
        points, [](const Point3& p) { return p.x > 0.0; }, 0.5);
    expectShare(
        points, [](const Point3& p) { return p.x > 1.0; }, 0.25 / 1.5);
}

// Two abutting halves of a box look like one box: no point is on the shared face.
TEST(Solid, OmitsTouchingFaces) {
    const Solid solid{{block({-0.5, 0, 0}, {0.5, 1, 1}), block({0.5, 0, 0}, {0.5, 1, 1})}};
    const PointCloud points = sample(solid);
    for (const Point3& p : points) {
        EXPECT_NEAR(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 1.0, 1e-12);
    }
    expectShare(
        points, [](const Point3& p) { return p.x < -1.0 + 1e-9; }, 1.0 / 6.0);
    expectShare(
        points, [](const Point3& p) { return p.x < 0.0; }, 0.5);
}

// Two overlapping boxes with all long faces in common: the overlap is not sampled twice.
TEST(Solid, CountsCoincidentFacesOnce) {
    const Solid solid{{block({-0.5, 0, 0}, {1.0, 1, 1}), block({0.5, 0, 0}, {1.0, 1, 1})}};
    const PointCloud points = sample(solid);
    const double area = 2.0 * 4.0 + 4.0 * 6.0;
    expectShare(
        points, [](const Point3& p) { return std::abs(p.x) < 0.5; }, 8.0 / area);
}

TEST(Solid, ContainsAgreesWithTheDefinitions) {
    const Solid pipe{{cylinder({0, 0, -1}, {0, 0, 1}, 1.0, 0.5)}};
    EXPECT_FALSE(contains(pipe, {}));
    EXPECT_TRUE(contains(pipe, {0.75, 0, 0.5}));
    EXPECT_FALSE(contains(pipe, {0.75, 0, 1.01}));
    const Solid capsule{{rod({0, 0, 0}, {2, 0, 0}, 0.5)}};
    EXPECT_TRUE(contains(capsule, {2.49, 0, 0}));
    EXPECT_FALSE(contains(capsule, {2.4, 0.4, 0}));
    const Solid torus{{ring({}, {0, 0, 1}, 1.0, 0.25)}};
    EXPECT_FALSE(contains(torus, {}));
    EXPECT_TRUE(contains(torus, {0, 1.2, 0}));
    const Solid both{{ball({}, 0.5), rod({0, 0, 0}, {2, 0, 0}, 0.5)}};
    EXPECT_TRUE(contains(both, {-0.49, 0, 0}));
    EXPECT_TRUE(contains(both, {2.0, 0, 0}));
    const Solid box{{block({1, 0, 0}, {1, 1, 1}, rotationAboutZ(kPi / 4))}};
    EXPECT_TRUE(contains(box, {1 + 1.4, 0, 0}));
    EXPECT_FALSE(contains(box, {2, 0.9, 0}));
}

TEST(Solid, VolumesOfPrimitives) {
    const std::vector<double> expected = {
        4.0 / 3.0 * kPi * 0.343, 4.0 / 3.0 * kPi * 0.1,       kPi * 0.16 * 3.0 + 4.0 / 3.0 * kPi * 0.064,
        kPi * 0.16 * 3.0,        kPi * (0.16 - 0.0625) * 3.0, 8.0 * 0.3 * 0.6 * 0.9,
        2.0 * kPi * kPi * 0.09};
    const std::vector<Solid> solids = onePrimitiveEach();
    for (std::size_t i = 0; i < solids.size(); ++i) {
        EXPECT_NEAR(volumeOf(solids[i], 300000), expected[i], 0.005 * expected[i]) << "shape " << i;
        EXPECT_EQ(volumeOf(solids[i], 1000), volumeOf(solids[i], 1000));
        const Motion motion = someMotion(i);
        EXPECT_NEAR(volumeOf(movedSolid(motion, solids[i]), 300000), std::pow(motion.scale, 3) * expected[i],
                    0.005 * std::pow(motion.scale, 3) * expected[i]);
    }
    EXPECT_EQ(volumeOf(solids[0], 0), 0.0);
}

TEST(Solid, MovedSolidContainsMovedPoints) {
    const Solid solid{{ball({}, 0.5), rod({0, 0, 0}, {2, 0, 0}, 0.3), block({0, 1, 0}, {0.2, 0.8, 0.3})}};
    const Motion motion = someMotion(3);
    const Solid moved = movedSolid(motion, solid);
    EXPECT_TRUE(checkSolid(moved));
    EXPECT_NEAR(thinnestPart(moved), motion.scale * 0.4, 1e-12);
    Random random(4);
    for (int i = 0; i < 2000; ++i) {
        const Point3 p{random.uniform(-1, 3), random.uniform(-1, 2), random.uniform(-1, 1)};
        EXPECT_EQ(contains(moved, apply(motion, p)), contains(solid, p));
    }
}

TEST(Solid, IsReproducibleBySeed) {
    const Solid solid{{ball({}, 1.0), rod({0, 0, 0}, {2, 0, 0}, 0.5)}};
    EXPECT_EQ(sample(solid, 100, 1), sample(solid, 100, 1));
    EXPECT_NE(sample(solid, 100, 1), sample(solid, 100, 2));
}

TEST(Solid, RefusesInvalidSolids) {
    const auto expectRefused = [](const Solid& solid, const std::string& part) {
        for (const auto& error : {checkSolid(solid).error(), sampleBoundary(solid, 10, 1).error()}) {
            EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
            EXPECT_NE(error.message.find(part), std::string::npos) << error.message;
        }
    };
    expectRefused({}, "no parts");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const SolidShape& shape : std::vector<SolidShape>{
             SolidSphere{0.0}, SolidSphere{nan}, SolidEllipsoid{{1, -1, 1}}, SolidCapsule{1, 0},
             SolidTube{1, 1, 1}, SolidTube{1, 1, -0.1}, SolidBox{{1, 1, INFINITY}}, SolidTorus{1, 1}}) {
        expectRefused({{ball({}, 1.0), {shape, {}}}}, "part 1");
    }
    Solid bent{{ball({}, 1.0)}};
    bent.parts[0].placement.rotation[0][1] = 0.1;
    expectRefused(bent, "part 0");
    Solid mirrored{{ball({}, 1.0)}};
    mirrored.parts[0].placement.reflected = true;
    expectRefused(mirrored, "part 0");
    Solid lost{{ball({nan, 0, 0}, 1.0)}};
    expectRefused(lost, "part 0");
    EXPECT_EQ(sampleBoundary({{ball({}, 1.0)}}, 0, 1).error().code, ErrorCode::kInvalidArgument);
}

// A box around ten thousand hidden ones is refused, instead of running for ever.
TEST(Solid, RefusesASolidWithHardlyAnyBoundary) {
    Solid solid{{block({}, {1.0, 1.0, 1.0})}};
    for (int i = 0; i < 10000; ++i) solid.parts.push_back(block({}, {0.999, 0.999, 0.999}));
    const auto points = sampleBoundary(solid, 1000, 1);
    ASSERT_FALSE(points);
    EXPECT_EQ(points.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace shapedb
