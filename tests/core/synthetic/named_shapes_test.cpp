// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/named_shapes.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(NamedShapes, AreUsableAndDistinct) {
    std::set<std::string> names;
    for (const NamedShape& shape : namedShapes()) {
        EXPECT_TRUE(checkSolid(shape.solid)) << shape.name;
        EXPECT_TRUE(names.insert(shape.name).second);
        const Box bounds = boundsOf(shape.solid);
        EXPECT_GT(thinnestPart(shape.solid), 0.03 * bounds.diagonal()) << shape.name;
        // About the origin.
        EXPECT_LT(length(bounds.low + bounds.high), 1e-12) << shape.name;
    }
    EXPECT_EQ(names, (std::set<std::string>{"sphere", "torus", "box", "l_shape", "dumbbell", "jack"}));
}

TEST(NamedShapes, VolumesAgreeWithCounting) {
    for (const NamedShape& shape : namedShapes()) {
        EXPECT_NEAR(volumeOf(shape.solid, 1000000), shape.volume, 0.004 * shape.volume) << shape.name;
    }
}

TEST(NamedShapes, BallsAreInsideAndTouchedBySamples) {
    for (const NamedShape& shape : namedShapes()) {
        const auto points = sampleBoundary(shape.solid, 20000, 3);
        ASSERT_TRUE(points) << shape.name;
        for (const KnownBall& known : shape.balls) {
            EXPECT_NEAR(known.volume(), 4.18879020478639 * std::pow(known.radius, 3), 1e-9);
            double nearest = 1e9;
            int onBall = 0;
            for (const Point3& p : *points) {
                const double gap = distance(p, known.centre) - known.radius;
                nearest = std::min(nearest, gap);
                onBall += std::abs(gap) < 1e-9 ? 1 : 0;
            }
            EXPECT_GT(nearest, -1e-9) << shape.name << ": the boundary enters a ball";
            EXPECT_GT(onBall, 500) << shape.name;
        }
    }
}

TEST(NamedShapes, HaveKnownVolumes) {
    EXPECT_NEAR(makeSphere().volume, 4.18879020478639, 1e-12);
    EXPECT_NEAR(makeTorus().volume, 2.41805, 1e-5);
    EXPECT_NEAR(makeBox().volume, 2.8, 1e-12);
    EXPECT_NEAR(makeLShape().volume, 2.4, 1e-12);
    // Two balls (8.37758), one unit of a rod of radius 0.3 (0.28274), and two thin rims.
    EXPECT_NEAR(makeDumbbell().volume, 8.37758 + 0.28274, 0.02);
    EXPECT_GT(makeDumbbell().volume, 8.37758 + 0.28274);
    EXPECT_EQ(makeDumbbell().balls.size(), 2U);
    const NamedShape jack = makeJack();
    ASSERT_EQ(jack.balls.size(), 7U);
    EXPECT_EQ(jack.balls[0].radius, 0.8);
    for (std::size_t i = 1; i < 7; ++i) EXPECT_NEAR(length(jack.balls[i].centre), 2.4, 1e-12);
}

}  // namespace
}  // namespace shapedb
