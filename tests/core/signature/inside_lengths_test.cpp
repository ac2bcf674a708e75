// SPDX-License-Identifier: GPL-3.0-or-later
// Bending and centrality of shapes whose inside distances are known, with and without noise.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/pipeline.h"
#include "core/signature/inner_distances.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

constexpr double kRing = 1.0;
constexpr double kTube = 0.35;

bool insideTorus(const Point3& p) {
    return std::hypot(std::hypot(p.x, p.y) - kRing, p.z) < kTube * (1.0 + 1e-9);
}

bool lineInsideTorus(const Point3& a, const Point3& b) {
    constexpr int kSteps = 24;
    for (int i = 1; i < kSteps; ++i) {
        if (!insideTorus(a + (1.0 / kSteps) * i * (b - a))) return false;
    }
    return true;
}

struct Means {
    double straight;
    double inside;
};

// By a graph of all lines of sight between random points inside and points of the wall around the hole, where
// paths turn. Paths are a little too long: the points of the wall are not everywhere.
Means meansInTorus() {
    constexpr std::size_t kPlaces = 300;
    constexpr std::size_t kAround = 48;
    constexpr std::size_t kUp = 9;
    Random random(5);
    PointCloud nodes;
    while (nodes.size() < kPlaces) {
        const Point3 p{random.uniform(-1.35, 1.35), random.uniform(-1.35, 1.35), random.uniform(-0.35, 0.35)};
        if (insideTorus(p)) nodes.push_back(p);
    }
    for (std::size_t i = 0; i < kAround; ++i) {
        for (std::size_t j = 0; j < kUp; ++j) {
            const double turn = 2.0 * kPi * static_cast<double>(i) / kAround;
            const double up = 1.4 * (2.0 * static_cast<double>(j) / (kUp - 1) - 1.0);
            const double radius = kRing - kTube * std::cos(up);
            nodes.push_back({radius * std::cos(turn), radius * std::sin(turn), kTube * std::sin(up)});
        }
    }
    const std::size_t n = nodes.size();
    std::vector<double> way(n * n, 1e9);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            // Neighbours on the wall see each other but for the curve between them.
            const bool along = i >= kPlaces && j >= kPlaces && distance(nodes[i], nodes[j]) < 0.15;
            if (!along && !lineInsideTorus(nodes[i], nodes[j])) continue;
            way[i * n + j] = way[j * n + i] = distance(nodes[i], nodes[j]);
        }
    }
    double straight = 0.0;
    double inside = 0.0;
    for (std::size_t s = 0; s < kPlaces; ++s) {
        std::vector<double> length(way.begin() + static_cast<std::ptrdiff_t>(s * n),
                                   way.begin() + static_cast<std::ptrdiff_t>((s + 1) * n));
        std::vector<bool> done(n, false);
        done[s] = true;
        for (std::size_t round = 1; round < n; ++round) {
            std::size_t next = n;
            for (std::size_t i = 0; i < n; ++i) {
                if (!done[i] && (next == n || length[i] < length[next])) next = i;
            }
            done[next] = true;
            for (std::size_t i = 0; i < n; ++i) {
                length[i] = std::min(length[i], length[next] + way[next * n + i]);
            }
        }
        for (std::size_t i = 0; i < kPlaces; ++i) {
            if (i == s) continue;
            straight += distance(nodes[s], nodes[i]);
            inside += length[i];
        }
    }
    const double pairs = static_cast<double>(kPlaces * (kPlaces - 1));
    return {straight / pairs, inside / pairs};
}

// A bar of square section bent to half a ring about the z axis: shortest paths in closed form.
constexpr double kInnerRadius = 0.75;
constexpr double kOuterRadius = 1.25;
constexpr double kHeight = 0.5;

// In the plane straight, or two tangents to the inner wall and the arc between.
double roundTheWall(double a, double b, double angle) {
    const double tangents = std::acos(kInnerRadius / a) + std::acos(kInnerRadius / b);
    if (angle <= tangents) return std::sqrt(a * a + b * b - 2.0 * a * b * std::cos(angle));
    return std::sqrt(a * a - kInnerRadius * kInnerRadius) + std::sqrt(b * b - kInnerRadius * kInnerRadius) +
           kInnerRadius * (angle - tangents);
}

double radiusInBar(Random& random) {
    const double low = kInnerRadius * kInnerRadius;
    return std::sqrt(low + random.uniform() * (kOuterRadius * kOuterRadius - low));
}

Means meansInBentBar() {
    Random random(4);
    constexpr int kPairs = 200000;
    Means sum{0.0, 0.0};
    for (int i = 0; i < kPairs; ++i) {
        const double angle = kPi * std::abs(random.uniform() - random.uniform());
        const double a = radiusInBar(random);
        const double b = radiusInBar(random);
        const double up = kHeight * (random.uniform() - random.uniform());
        sum.straight += std::sqrt(a * a + b * b - 2.0 * a * b * std::cos(angle) + up * up);
        sum.inside += std::hypot(roundTheWall(a, b, angle), up);
    }
    return {sum.straight / kPairs, sum.inside / kPairs};
}

// Uniform by area.
PointCloud bentBar(std::size_t count) {
    Random random(12);
    PointCloud points;
    const double flat = kPi / 2.0 * (kOuterRadius * kOuterRadius - kInnerRadius * kInnerRadius);
    const double walls = kPi * kHeight * (kInnerRadius + kOuterRadius);
    const double ends = 2.0 * kHeight * (kOuterRadius - kInnerRadius);
    while (points.size() < count) {
        const double which = random.uniform() * (2.0 * flat + walls + ends);
        double angle = kPi * random.uniform();
        double radius = radiusInBar(random);
        double z = kHeight * random.uniform();
        if (which < 2.0 * flat) {
            z = which < flat ? 0.0 : kHeight;
        } else if (which < 2.0 * flat + walls) {
            const double share = (which - 2.0 * flat) / walls;
            radius = share < kInnerRadius / (kInnerRadius + kOuterRadius) ? kInnerRadius : kOuterRadius;
        } else {
            radius = random.uniform(kInnerRadius, kOuterRadius);
            angle = which < 2.0 * flat + walls + 0.5 * ends ? 0.0 : kPi;
        }
        points.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
    }
    return points;
}

struct Measured {
    double mean;     // inside distance, scan units
    double bending;  // mean of its histogram
    double least;    // centrality of the most central cell
    double most;     // of the outermost
};

Measured measured(PointCloud points, double noise) {
    EXPECT_TRUE(addGaussianNoise(points, noise, 8));
    const auto description = describe(points, parametersOf(Profile::kDefault)).value();
    const auto inner = innerDistances(interiorView(description.segmentation)).value();
    Measured result{inner.mean * description.segmentation.size, 0.0, 1e9, 0.0};
    const StatisticLayout& bending = kStatistics[static_cast<std::size_t>(Statistic::kBending)];
    double sum = 0.0;
    for (std::size_t i = 0; i < bending.count; ++i) {
        const double share = shareOfLevel(description.signature.attributes->statistics[bending.offset + i]);
        result.bending += share * (static_cast<double>(i) + 0.5) * 2.6 / bending.count;
        sum += share;
    }
    result.bending /= sum;
    for (std::size_t c = 0; c < inner.centres.size(); ++c) {
        double of = 0.0;
        for (const auto& row : inner.distance) of += row[c];
        of /= static_cast<double>(inner.sources.size()) * inner.mean;
        if (of > 1e6) continue;  // a crumb that noise has cut off
        result.least = std::min(result.least, of);
        result.most = std::max(result.most, of);
    }
    return result;
}

constexpr double kNoises[] = {0.005, 0.01};

PointCloud scan(const Solid& solid) { return sampleBoundary(solid, 6000, 7).value(); }

// Straight lines stay inside, so the mean of straight over mean inside distance is 1.
void expectConvex(const Solid& solid, double mean, double least, double most, const char* what) {
    const PointCloud points = scan(solid);
    const Measured clean = measured(points, 0.0);
    EXPECT_NEAR(clean.mean, mean, 0.03 * mean) << what;
    EXPECT_NEAR(clean.bending, 1.0, 0.03) << what;
    EXPECT_NEAR(clean.least, least, 0.03 * least) << what << ", its centre";
    // The centre of the outermost cell is half a cell from the corner.
    EXPECT_LT(clean.most, 1.03 * most) << what << ", its corners";
    EXPECT_GT(clean.most, 0.9 * most) << what << ", its corners";
    for (const double noise : kNoises) {
        const Measured noisy = measured(points, noise);
        EXPECT_NEAR(noisy.mean, clean.mean, 0.05 * clean.mean) << what << ", noise " << noise;
        EXPECT_NEAR(noisy.bending, clean.bending, 0.05 * clean.bending) << what << ", noise " << noise;
        EXPECT_NEAR(noisy.least, clean.least, 0.05 * clean.least) << what << ", noise " << noise;
        EXPECT_NEAR(noisy.most, clean.most, 0.05 * clean.most) << what << ", noise " << noise;
    }
}

TEST(InsideLengths, OfABall) {
    // From the centre 3/4, from the surface 6/5, among all 36/35 of the radius.
    expectConvex(makeSphere().solid, 36.0 / 35.0, 0.75 * 35.0 / 36.0, 1.2 * 35.0 / 36.0, "ball");
}

TEST(InsideLengths, OfACube) {
    // Robbins' constant; from the centre half of what it is from a corner.
    expectConvex({{SolidPart{SolidBox{{0.5, 0.5, 0.5}}, {}}}}, 0.6617, 0.4803 / 0.6617, 0.9606 / 0.6617,
                 "cube");
}

TEST(InsideLengths, OfARod) {
    // Its thickness adds less than 1 %.
    expectConvex({{SolidPart{SolidBox{{1.0, 0.08, 0.08}}, {}}}}, 2.0 / 3.0, 0.75, 1.5, "rod");
}

void expectBent(const PointCloud& points, const Means& means, const char* what) {
    const double bending = means.straight / means.inside;
    EXPECT_LT(bending, 0.98) << what << ": the hole is in the way";
    const Measured clean = measured(points, 0.0);
    EXPECT_NEAR(clean.mean, means.inside, 0.03 * means.inside) << what;
    EXPECT_NEAR(clean.bending, bending, 0.03 * bending) << what;
    for (const double noise : kNoises) {
        const Measured noisy = measured(points, noise);
        EXPECT_NEAR(noisy.mean, clean.mean, 0.05 * clean.mean) << what << ", noise " << noise;
        EXPECT_NEAR(noisy.bending, clean.bending, 0.05 * clean.bending) << what << ", noise " << noise;
    }
}

TEST(InsideLengths, OfATorus) { expectBent(scan(makeTorus().solid), meansInTorus(), "torus"); }

TEST(InsideLengths, OfAHorseshoe) { expectBent(bentBar(6000), meansInBentBar(), "bent bar"); }

}  // namespace
}  // namespace shapedb
