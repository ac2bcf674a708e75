// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/shell_harmonics.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "tests/core/signature/cube_views.h"

namespace shapedb {
namespace {

using testing_support::triangle;

PointCloud lopsided(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back({3.0 * random.normal() + 1.0, std::abs(random.normal()), random.uniform(-1, 4)});
    }
    return points;
}

double legendre(std::size_t degree, double x) {
    double before = 1.0;
    double now = x;
    for (std::size_t l = 2; l <= degree; ++l) {
        const double k = static_cast<double>(l);
        const double next = ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k;
        before = now;
        now = next;
    }
    return now;
}

// By the addition theorem, without spherical harmonics: the energy of degree l is the sum over all pairs of
// points of P_l of the cosine of the angle between them.
ShellEnergies plainEnergies(const PointCloud& points, const std::vector<double>& weights) {
    double n = 0.0;
    for (const double w : weights) n += w;
    Point3 centre;
    for (std::size_t i = 0; i < points.size(); ++i) centre = centre + weights[i] * points[i];
    centre = (1.0 / n) * centre;
    double mean = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) mean += weights[i] * distance(points[i], centre) / n;
    ShellEnergies energies{};
    for (std::size_t shell = 0; shell < kShells; ++shell) {
        for (std::size_t degree = 1; degree <= kDegrees; ++degree) {
            double energy = 0.0;
            const auto weightIn = [&](std::size_t i) {
                return weights[i] / n *
                       triangle(distance(points[i], centre), 0.0, 2.0 * mean, kShells, shell);
            };
            for (std::size_t i = 0; i < points.size(); ++i) {
                if (weightIn(i) == 0.0) continue;
                for (std::size_t j = 0; j < points.size(); ++j) {
                    if (weightIn(j) == 0.0) continue;
                    const Point3 p = points[i] - centre;
                    const Point3 q = points[j] - centre;
                    energy +=
                        weightIn(i) * weightIn(j) * legendre(degree, dot(p, q) / (length(p) * length(q)));
                }
            }
            energies[shell * kDegrees + degree - 1] = energy;
        }
    }
    return energies;
}

TEST(ShellHarmonics, AgreeWithTheAdditionTheorem) {
    for (const std::size_t count : {2U, 3U, 10U, 120U}) {
        const PointCloud points = lopsided(count, count);
        std::vector<double> weights(count, 1.0);
        for (const bool weighted : {false, true}) {
            Random random(count);
            for (double& w : weights) w = weighted ? random.uniform(0.0, 1e-3) : 1.0;
            const ShellEnergies fast = shellHarmonics(points, weighted ? weights : std::vector<double>{});
            const ShellEnergies plain = plainEnergies(points, weights);
            for (std::size_t i = 0; i < fast.size(); ++i) {
                EXPECT_NEAR(fast[i] * fast[i], plain[i], 1e-12) << count << " points, energy " << i;
            }
        }
    }
}

TEST(ShellHarmonics, DoNotChangeUnderMotions) {
    const PointCloud points = lopsided(300, 7);
    const ShellEnergies still = shellHarmonics(points);
    Random random(3);
    for (int turn = 0; turn < 20; ++turn) {
        Motion motion;
        motion.rotation = randomRotation(random);
        motion.reflected = turn % 2 == 1;
        if (motion.reflected) {
            for (double& x : motion.rotation[1]) x = -x;
        }
        motion.scale = std::pow(10.0, random.uniform(-6, 6));
        motion.translation = (5.0 * motion.scale) * Point3{random.normal(), random.normal(), random.normal()};
        const ShellEnergies moved = shellHarmonics(applyToCloud(motion, points));
        for (std::size_t i = 0; i < still.size(); ++i) EXPECT_NEAR(moved[i], still[i], 1e-7);
    }
}

TEST(ShellHarmonics, AreOneForASingleDirection) {
    // Half the points in each direction of one axis: a single direction for even degrees, none for odd ones.
    const PointCloud points = {{1, 2, 3}, {-1, -2, -3}};
    const ShellEnergies energies = shellHarmonics(points);
    for (std::size_t degree = 1; degree <= kDegrees; ++degree) {
        double sum = 0.0;
        for (std::size_t shell = 0; shell < kShells; ++shell) sum += energies[shell * kDegrees + degree - 1];
        EXPECT_NEAR(sum, degree % 2 == 0 ? 1.0 : 0.0, 1e-12) << degree;
    }
    // Nearly all points at one place, balanced by a few distant ones.
    PointCloud spot(999, Point3{0, 0, 1});
    spot.push_back({0, 0, -999});
    const ShellEnergies one = shellHarmonics(spot);
    for (std::size_t degree = 1; degree <= kDegrees; ++degree) {
        double sum = 0.0;
        for (std::size_t shell = 0; shell + 1 < kShells; ++shell) sum += one[shell * kDegrees + degree - 1];
        EXPECT_NEAR(sum, 0.999, 1e-9) << degree;
    }
}

TEST(ShellHarmonics, AreSmallForASphere) {
    Random random(4);
    PointCloud sphere;
    while (sphere.size() < 20000) {
        const Point3 p{random.normal(), random.normal(), random.normal()};
        if (length(p) > 0.0) sphere.push_back((1.0 / length(p)) * p);
    }
    for (const double energy : shellHarmonics(sphere)) EXPECT_LT(energy, 0.03);
}

TEST(ShellHarmonics, StayWithinTheirRange) {
    for (const double energy : shellHarmonics({{5, 5, 5}})) EXPECT_EQ(energy, 0.0);
    for (const double energy : shellHarmonics(PointCloud(10, Point3{0.1, 0.2, 0.3}))) {
        EXPECT_GE(energy, 0.0);
        EXPECT_LE(energy, 1.0);
    }
    Random random(6);
    for (int round = 0; round < 50; ++round) {
        for (const double energy : shellHarmonics(lopsided(2 + random.below(50), random.next()))) {
            ASSERT_GE(energy, 0.0);
            ASSERT_LE(energy, 1.0);
        }
    }
}

}  // namespace
}  // namespace shapedb
