// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/segmentation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/geometry/bounding.h"
#include "core/geometry/neighbours.h"
#include "core/pipeline.h"
#include "core/segmentation/interior.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

PointCloud sample(const NamedShape& shape, std::size_t count, double noise, std::uint64_t seed) {
    PointCloud points = sampleBoundary(shape.solid, count, seed).value();
    EXPECT_TRUE(addGaussianNoise(points, noise, seed + 1));
    return points;
}

std::array<Point3, 4> corners(const Segmentation& s, std::size_t t) {
    const auto& v = s.tetrahedra.vertices[t];
    return {s.sites[v[0]], s.sites[v[1]], s.sites[v[2]], s.sites[v[3]]};
}

double volumeOf(const std::array<Point3, 4>& p) {
    return dot(p[1] - p[0], cross(p[2] - p[0], p[3] - p[0])) / 6.0;
}

class SegmentationOfShape : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        points_ = new PointCloud(sample(makeDumbbell(), 3000, 0.002, 5));
        points_->push_back(points_->front());
        result_ = new Segmentation(segment(*points_, {}).value());
    }
    static void TearDownTestSuite() {
        delete points_;
        delete result_;
    }
    static PointCloud* points_;
    static Segmentation* result_;
};
PointCloud* SegmentationOfShape::points_ = nullptr;
Segmentation* SegmentationOfShape::result_ = nullptr;

TEST_F(SegmentationOfShape, CountsAndMapsAreConsistent) {
    const Segmentation& s = *result_;
    EXPECT_EQ(s.duplicates, 1U);
    EXPECT_EQ(s.sites.size(), points_->size() - 1);
    ASSERT_EQ(s.siteOfPoint.size(), points_->size());
    ASSERT_EQ(s.pointSegment.size(), points_->size());
    ASSERT_EQ(s.tetrahedronSegment.size(), s.tetrahedra.size());
    for (std::size_t i = 0; i < points_->size(); ++i) {
        EXPECT_LT(distance(s.sites[s.siteOfPoint[i]], (*points_)[i]), 1e-14);
    }
    EXPECT_EQ(s.siteOfPoint.front(), s.siteOfPoint.back());
    std::uint64_t labelled = 0;
    for (const std::int32_t label : s.tetrahedronSegment) labelled += label >= 0;
    EXPECT_EQ(labelled, s.interiorTetrahedra);
    EXPECT_LE(s.interiorTetrahedra, s.bigBalls);
    EXPECT_LE(s.bigBalls, s.tetrahedra.size());
    EXPECT_GE(s.maxima, 2U);
    EXPECT_GE(s.maxima, s.segments.size()) << "there are no islands here";
}

TEST_F(SegmentationOfShape, CircumspheresAreInScanUnits) {
    const Segmentation& s = *result_;
    for (std::size_t t = 0; t < s.tetrahedra.size(); ++t) {
        for (const Point3& corner : corners(s, t)) {
            ASSERT_NEAR(distance(s.tetrahedra.circumcentres[t], corner), s.tetrahedra.circumradii[t],
                        1e-8 * s.tetrahedra.circumradii[t]);
        }
    }
}

TEST_F(SegmentationOfShape, MomentsAgreeWithDirectSummation) {
    const Segmentation& s = *result_;
    std::vector<double> volume(s.segments.size(), 0.0);
    std::vector<Point3> first(s.segments.size());
    std::vector<double> largest(s.segments.size(), 0.0);
    for (std::size_t t = 0; t < s.tetrahedra.size(); ++t) {
        if (s.tetrahedronSegment[t] < 0) continue;
        const auto at = static_cast<std::size_t>(s.tetrahedronSegment[t]);
        const auto p = corners(s, t);
        volume[at] += volumeOf(p);
        first[at] = first[at] + (volumeOf(p) / 4.0) * (p[0] + p[1] + p[2] + p[3]);
        largest[at] = std::max(largest[at], s.tetrahedra.circumradii[t]);
    }
    double last = INFINITY;
    for (std::size_t i = 0; i < s.segments.size(); ++i) {
        const Segment& segment = s.segments[i];
        EXPECT_NEAR(segment.volume, volume[i], 1e-10 * volume[i] + 1e-18);
        if (segment.volume > 1e-9) {
            EXPECT_LT(distance(segment.centroid, (1.0 / volume[i]) * first[i]), 1e-9);
        }
        EXPECT_LE(segment.maximumRadius, largest[i] * (1 + 1e-12));
        EXPECT_LE(segment.volume, last);
        EXPECT_GT(segment.volume, 0.0);
        last = segment.volume;
    }
    EXPECT_NEAR(s.volume, std::accumulate(volume.begin(), volume.end(), 0.0), 1e-10 * s.volume);
}

// A uniform point of a tetrahedron (folding the unit cube).
Point3 uniformIn(const std::array<Point3, 4>& p, Random& random) {
    double a = random.uniform(), b = random.uniform(), c = random.uniform();
    double u[3] = {a, b, c};
    std::sort(u, u + 3);
    return u[0] * p[0] + (u[1] - u[0]) * p[1] + (u[2] - u[1]) * p[2] + (1 - u[2]) * p[3];
}

TEST_F(SegmentationOfShape, CovarianceAgreesWithMonteCarlo) {
    const Segmentation& s = *result_;
    Random random(11);
    for (std::int32_t label = 0; label < 2; ++label) {
        const Segment& segment = s.segments[static_cast<std::size_t>(label)];
        std::array<double, 6> sums{};
        double weight = 0.0;
        for (std::size_t t = 0; t < s.tetrahedra.size(); ++t) {
            if (s.tetrahedronSegment[t] != label) continue;
            const auto p = corners(s, t);
            for (int i = 0; i < 60; ++i) {
                const Point3 d = uniformIn(p, random) - segment.centroid;
                const double products[6] = {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};
                for (std::size_t k = 0; k < 6; ++k) sums[k] += volumeOf(p) * products[k];
                weight += volumeOf(p);
            }
        }
        const double trace = segment.covariance[0] + segment.covariance[3] + segment.covariance[5];
        for (std::size_t k = 0; k < 6; ++k) {
            EXPECT_NEAR(segment.covariance[k], sums[k] / weight, 0.005 * trace) << k;
        }
        // A ball of radius 1 has variance 1/5 along each axis.
        EXPECT_NEAR(trace, 0.6, 0.03);
    }
}

TEST_F(SegmentationOfShape, PointsBelongToTheLargestInnerBallAtThem) {
    const Segmentation& s = *result_;
    std::vector<std::vector<std::size_t>> around(s.sites.size());
    for (std::size_t t = 0; t < s.tetrahedra.size(); ++t) {
        for (const std::uint32_t v : s.tetrahedra.vertices[t]) around[v].push_back(t);
    }
    std::size_t touching = 0;
    for (std::size_t i = 0; i < points_->size(); ++i) {
        double largest = 0.0;
        std::set<std::int32_t> allowed;
        for (const std::size_t t : around[s.siteOfPoint[i]]) {
            if (s.tetrahedronSegment[t] < 0 || s.tetrahedra.circumradii[t] < largest) continue;
            if (s.tetrahedra.circumradii[t] > largest) allowed.clear();
            largest = s.tetrahedra.circumradii[t];
            allowed.insert(s.tetrahedronSegment[t]);
        }
        if (allowed.empty()) allowed.insert(-1);
        EXPECT_TRUE(allowed.count(s.pointSegment[i])) << i;
        touching += s.pointSegment[i] >= 0;
    }
    EXPECT_GT(touching, points_->size() * 9 / 10);
}

PointCloud cornersOfInterior(const Segmentation& s) {
    std::set<std::uint32_t> used;
    for (std::size_t t = 0; t < s.tetrahedra.size(); ++t) {
        if (s.tetrahedronSegment[t] >= 0)
            used.insert(s.tetrahedra.vertices[t].begin(), s.tetrahedra.vertices[t].end());
    }
    PointCloud inner;
    for (const std::uint32_t v : used) inner.push_back(s.sites[v]);
    return inner;
}

TEST_F(SegmentationOfShape, SizeIsTheSmallestBoxAroundTheInterior) {
    const Segmentation& s = *result_;
    EXPECT_NEAR(s.size, *smallestBoxDiagonal(cornersOfInterior(s)), 1e-3 * s.size);
    EXPECT_NEAR(s.size, std::sqrt(25.0 + 4.0 + 4.0), 0.02 * s.size);
}

// When the hull of the interior is not that of all points.
TEST(Segmentation, SizeIgnoresPointsOutsideTheInterior) {
    PointCloud points = sample(makeDumbbell(), 3000, 0.0, 5);
    for (int i = 0; i < 20; ++i) {
        for (int k = 0; k < 20; ++k) points.push_back({0.01 * k, 0.02 * k, 2.0 + 0.2 * i});
    }
    const auto s = segment(points, {});
    ASSERT_TRUE(s) << s.error().message;
    const PointCloud inner = cornersOfInterior(*s);
    ASSERT_LT(inner.size() + 200, points.size());
    EXPECT_NEAR(s->size, *smallestBoxDiagonal(inner), 1e-3 * s->size);
    EXPECT_LT(s->size, 0.9 * *smallestBoxDiagonal(s->sites));
}

TEST_F(SegmentationOfShape, StagesAreTimedInOrder) {
    std::vector<std::string> names;
    double sum = 0.0;
    for (const StageTime& stage : result_->stages) {
        names.push_back(stage.stage);
        EXPECT_GT(stage.seconds, 0.0) << stage.stage;
        sum += stage.seconds;
    }
    EXPECT_EQ(names, (std::vector<std::string>{"sanitise", "delaunay", "point_scale", "interior", "flow",
                                               "segments", "merge", "describe"}));
    EXPECT_LE(sum, result_->totalSeconds * 1.001);
    EXPECT_GT(result_->delaunaySeconds, 0.0);
    EXPECT_LT(result_->delaunaySeconds, result_->totalSeconds);
}

TEST(Segmentation, OfFourPointsIsTheirTetrahedron) {
    // No ball is open to the outside, one is big: the whole is one segment.
    const double h = std::sqrt(0.5);
    const auto s = segment({{1, 0, -h}, {-1, 0, -h}, {0, 1, h}, {0, -1, h}}, {});
    ASSERT_TRUE(s);
    ASSERT_EQ(s->segments.size(), 1U);
    EXPECT_NEAR(s->volume, 8.0 / (6.0 * std::sqrt(2.0)), 1e-12);
    EXPECT_LT(length(s->segments[0].centroid), 1e-12);
    // Its circumsphere, of radius 1.22, is larger than a ball of its volume.
    EXPECT_NEAR(s->segments[0].maximumRadius, std::cbrt(s->volume * 3.0 / (4.0 * kPi)), 1e-12);
    // Second moments of a regular tetrahedron with edge a: a^2 / 40 about every axis.
    EXPECT_NEAR(s->segments[0].covariance[0], 4.0 / 40.0, 1e-12);
    EXPECT_NEAR(s->segments[0].covariance[3], 4.0 / 40.0, 1e-12);
    EXPECT_NEAR(s->segments[0].covariance[5], 4.0 / 40.0, 1e-12);
    EXPECT_NEAR(s->segments[0].covariance[1], 0.0, 1e-12);
    EXPECT_EQ(s->pointSegment, (std::vector<std::int32_t>{0, 0, 0, 0}));
}

TEST(Segmentation, HasNoSliversAndNoRadiusBeyondTheShape) {
    // Flat faces leave flat tetrahedra inside the surface, whose circumspheres reach far out.
    for (const std::uint64_t seed : {1, 2, 3}) {
        for (const NamedShape& shape : namedShapes()) {
            const PointCloud points = sample(shape, 6000, 0.0, seed);
            const auto s = segment(points, parametersOf(Profile::kDefault).segmentation);
            ASSERT_TRUE(s) << shape.name;
            for (const Segment& part : s->segments) {
                EXPECT_LE(part.maximumRadius, std::cbrt(s->volume * 3.0 / (4.0 * kPi)) * 1.001) << shape.name;
                const double ball = 4.0 / 3.0 * kPi * std::pow(part.maximumRadius, 3);
                EXPECT_TRUE(part.volume > 0.004 * s->volume || part.volume > 0.005 * ball)
                    << shape.name << ": " << part.volume / s->volume;
            }
        }
    }
}

TEST(Segmentation, VolumeOfKnownSolidsWithinTwoPercent) {
    for (const NamedShape& shape : namedShapes()) {
        const auto s = segment(sample(shape, 12000, 0.0, 1), {});
        ASSERT_TRUE(s) << shape.name;
        EXPECT_NEAR(s->volume, shape.volume, 0.02 * shape.volume) << shape.name;
    }
}

TEST(Segmentation, VolumeHardlyChangesUnderNoise) {
    // Noise eats into the skin; the paper has no figure.
    const NamedShape shape = makeDumbbell();
    const auto s = segment(sample(shape, 20000, 0.0025, 1), {});
    ASSERT_TRUE(s);
    EXPECT_NEAR(s->volume, shape.volume, 0.08 * shape.volume);
}

void expectBallsFirst(const NamedShape& shape, std::uint64_t seed) {
    const auto s = segment(sample(shape, 12000, 0.0, seed), {});
    ASSERT_TRUE(s) << shape.name;
    ASSERT_GE(s->segments.size(), shape.balls.size());
    std::set<std::size_t> found;
    for (std::size_t i = 0; i < shape.balls.size(); ++i) {
        const Segment& segment = s->segments[i];
        for (std::size_t b = 0; b < shape.balls.size(); ++b) {
            const KnownBall& ball = shape.balls[b];
            if (distance(segment.centroid, ball.centre) > 0.02 * s->size) continue;
            found.insert(b);
            EXPECT_NEAR(segment.volume, ball.volume(), 0.1 * ball.volume()) << shape.name << " ball " << b;
            EXPECT_NEAR(segment.maximumRadius, ball.radius, 0.02 * ball.radius)
                << shape.name << " ball " << b;
        }
    }
    EXPECT_EQ(found.size(), shape.balls.size()) << shape.name << ": each of the heaviest is another ball";
    if (s->segments.size() > shape.balls.size()) {
        EXPECT_LT(s->segments[shape.balls.size()].volume, 0.5 * s->segments[shape.balls.size() - 1].volume);
    }
}

TEST(Segmentation, HeaviestSegmentsOfTheDumbbellAreItsBalls) {
    for (const std::uint64_t seed : {1, 2}) expectBallsFirst(makeDumbbell(), seed);
}

TEST(Segmentation, HeaviestSegmentsOfTheJackAreItsBalls) {
    for (const std::uint64_t seed : {1, 2}) expectBallsFirst(makeJack(), seed);
}

TEST(Segmentation, ASphereIsOneHeavySegment) {
    const auto s = segment(sample(makeSphere(), 5000, 0.0, 4), {});
    ASSERT_TRUE(s);
    EXPECT_GT(s->segments[0].volume, 0.95 * s->volume);
    EXPECT_LT(length(s->segments[0].centroid), 0.01);
    EXPECT_NEAR(s->segments[0].maximumRadius, 1.0, 0.01);
}

TEST(Segmentation, DecimatesIfEnabled) {
    const PointCloud points = sample(makeDumbbell(), 20000, 0.0, 6);
    SegmentationOptions options;
    options.preparation.decimateTo = 5000;
    const auto s = segment(points, options);
    ASSERT_TRUE(s);
    EXPECT_LE(s->sites.size(), 5000U);
    EXPECT_GE(s->sites.size(), 4500U);
    ASSERT_EQ(s->pointSegment.size(), points.size());
    // A point is in the same cell as its site; there are 5,000 cells on a surface of area 26.
    for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_LT(distance(points[i], s->sites[s->siteOfPoint[i]]), 0.2);
    }
    EXPECT_EQ(s->stages[1].stage, std::string("decimate"));
    EXPECT_NEAR(s->volume, makeDumbbell().volume, 0.03 * makeDumbbell().volume);
    options.preparation.decimateTo = 20000;
    EXPECT_EQ(segment(points, options)->sites.size(), 20000U) << "no more than asked: left alone";
}

TEST(Segmentation, MergesMoreAtALargerRatio) {
    const PointCloud points = sample(makeLShape(), 4000, 0.003, 2);
    std::size_t last = SIZE_MAX;
    for (const double ratio : {1.0, 1.5, 3.0, 100.0}) {
        SegmentationOptions options;
        options.mergeRatio = ratio;
        const auto s = segment(points, options);
        ASSERT_TRUE(s);
        EXPECT_LE(s->segments.size(), last);
        last = s->segments.size();
    }
}

}  // namespace
}  // namespace shapedb
