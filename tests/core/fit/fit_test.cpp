// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/fit.h"

#include <atomic>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/fit/surface_points_codec.h"
#include "core/geometry/box.h"
#include "core/geometry/neighbours.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/signature/moved_scans.h"

namespace shapedb {
namespace {

PointCloud scanOfMember(const std::string& family, std::size_t index, std::uint64_t seed) {
    const auto member = makeMember(family, index, 1);
    ScanOptions options;
    options.randomPose = false;
    options.seed = seed;
    options.noise = 0.003;
    return *scanOf(*member, options);
}

Motion anyMotion(std::uint64_t seed, bool reflected, double scale) {
    Random random(seed);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.reflected = reflected;
    if (reflected) {
        for (auto& row : motion.rotation) row[2] = -row[2];
    }
    motion.scale = scale;
    motion.translation = {random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0)};
    return motion;
}

// Root of the mean squared distance between a surface moved in two ways, from both sides, over its diagonal:
// motions that a symmetry makes equal differ by little more than the spacing of the points.
double twoWayError(const PointCloud& surface, const Motion& a, const Motion& b) {
    PointCloud some;
    for (std::size_t i = 0; i < surface.size(); i += 4) some.push_back(surface[i]);
    const PointCloud first = applyToCloud(a, some);
    const PointCloud second = applyToCloud(b, some);
    const NeighbourIndex firstIndex(first);
    const NeighbourIndex secondIndex(second);
    std::vector<Neighbour> found;
    double sum = 0.0;
    for (const Point3& p : first) {
        secondIndex.nearest(p, 1, found);
        sum += found[0].squaredDistance;
    }
    for (const Point3& p : second) {
        firstIndex.nearest(p, 1, found);
        sum += found[0].squaredDistance;
    }
    return std::sqrt(sum / static_cast<double>(2 * some.size())) / boxOf(second).diagonal();
}

SurfacePoints surfaceOf(const PointCloud& scan) {
    auto surface = makeSurfacePoints(scan);
    EXPECT_TRUE(surface) << surface.error().message;
    return *surface;
}

FitResult fitted(const PointCloud& query, const PointCloud& other, const FitOptions& options) {
    auto result = fit(FitQuery(surfaceOf(query)), surfaceOf(other), options);
    EXPECT_TRUE(result) << result.error().message;
    return *result;
}

PointCloud damaged(const PointCloud& scan, FitKind kind, std::uint64_t seed) {
    Random random(seed);
    const Point3 direction = randomDirection(random);
    if (kind == FitKind::kOneSided) return seenFrom(scan, direction);
    if (kind == FitKind::kPiece) return cutBelow(scan, direction, 0.65);
    return scan;
}

TEST(Fit, FindsKnownMotions) {
    for (const FitKind kind : {FitKind::kWhole, FitKind::kOneSided, FitKind::kPiece}) {
        std::size_t right = 0;
        std::size_t tried = 0;
        for (const FamilyInfo& family : listFamilies()) {
            const PointCloud other = scanOfMember(family.name, 2, 11);
            const Motion motion = anyMotion(tried + 5, tried % 2 == 1, 1.7);
            const PointCloud query =
                applyToCloud(motion, damaged(scanOfMember(family.name, 2, 12), kind, tried + 1));
            FitOptions options;
            options.kinds = FitKinds::only(kind);
            const FitResult result = fitted(query, other, options);
            EXPECT_EQ(result.kind, kind);
            EXPECT_GT(result.best.score, 0.4) << family.name;
            EXPECT_LT(result.best.residual, 0.03) << family.name;
            const bool found = twoWayError(other, result.best.motion, motion) < 0.02;
            right += found ? 1 : 0;
            ++tried;
        }
        EXPECT_GE(right + (kind == FitKind::kWhole ? 0u : 1u), tried) << static_cast<int>(kind);
    }
}

TEST(Fit, ReportsASimilarityThatMatchesItsFields) {
    const PointCloud scan = scanOfMember("animal", 0, 1);
    const Motion motion = anyMotion(3, true, 0.01);
    FitOptions options;
    options.kinds = FitKinds::only(FitKind::kWhole);
    const FitPose best = fitted(applyToCloud(motion, scan), scanOfMember("animal", 0, 2), options).best;
    EXPECT_TRUE(best.motion.reflected);
    EXPECT_NEAR(determinant(best.motion.rotation), -1.0, 1e-9);
    EXPECT_NEAR(best.motion.scale, 0.01, 0.0003);
    EXPECT_NEAR(best.score, std::sqrt(best.explainedQuery * best.explainedOther), 1e-12);
}

TEST(Fit, KeepsTheScaleWhenAsked) {
    const PointCloud scan = scanOfMember("animal", 0, 1);
    FitOptions options;
    options.keepScale = true;
    options.kinds = FitKinds::only(FitKind::kWhole);
    const FitResult same =
        fitted(applyToCloud(anyMotion(3, false, 1.0), scan), scanOfMember("animal", 0, 2), options);
    EXPECT_EQ(same.best.motion.scale, 1.0);
    const FitResult half =
        fitted(applyToCloud(anyMotion(3, false, 0.5), scan), scanOfMember("animal", 0, 2), options);
    EXPECT_EQ(half.best.motion.scale, 1.0);
    EXPECT_LT(half.best.score, 0.6 * same.best.score);
}

TEST(Fit, TellsMirroredTwinsApartWithoutReflection) {
    FitOptions options;
    options.reflection = false;
    Motion mirror;
    mirror.reflected = true;
    mirror.rotation[0][0] = -1.0;
    for (const FitKind kind : {FitKind::kWhole, FitKind::kPiece}) {
        options.kinds = FitKinds::only(kind);
        for (const char* family : {"octopus", "human"}) {
            const PointCloud query =
                applyToCloud(anyMotion(8, false, 1.0), damaged(scanOfMember(family, 1, 1), kind, 2));
            const PointCloud own = scanOfMember(family, 1, 2);
            const FitResult right = fitted(query, own, options);
            const FitResult wrong = fitted(query, applyToCloud(mirror, own), options);
            EXPECT_FALSE(right.best.motion.reflected);
            EXPECT_FALSE(wrong.best.motion.reflected);
            EXPECT_GT(right.best.score, 1.05 * wrong.best.score) << family;
        }
    }
}

TEST(Fit, ShapesThatEqualTheirMirrorImageAreNotMirrored) {
    FitOptions options;
    options.kinds = FitKinds::only(FitKind::kWhole);
    for (const Solid& solid : {makeBox().solid, makeSphere().solid}) {
        for (std::uint64_t seed = 1; seed <= 6; ++seed) {
            const PointCloud query = *sampleBoundary(solid, 6000, seed);
            const PointCloud other =
                applyToCloud(anyMotion(seed, true, 1.0), *sampleBoundary(solid, 6000, seed + 100));
            const FitResult result = *align(FitQuery(surfaceOf(query)), surfaceOf(other), options);
            EXPECT_FALSE(result.best.motion.reflected) << seed;
            EXPECT_TRUE(result.handednessOpen) << seed;
            // Nothing better is found by who forbids reflection.
            FitOptions unmirrored = options;
            unmirrored.reflection = false;
            EXPECT_GE(result.best.score, 0.98 * fitted(query, other, unmirrored).best.score) << seed;
        }
    }
}

TEST(Fit, ReportsTheAxisOfARotationalSymmetry) {
    Solid pin;
    pin.parts.push_back({SolidTube{0.3, 1.0, 0.0}, {}});
    pin.parts.push_back({SolidCapsule{0.12, 1.5}, {}});
    const PointCloud other = *sampleBoundary(pin, 20000, 1);
    const Motion motion = anyMotion(4, false, 1.0);
    const PointCloud query = applyToCloud(motion, *sampleBoundary(pin, 20000, 2));
    FitOptions options;
    options.kinds = FitKinds::only(FitKind::kWhole);
    const FitResult result = fitted(query, other, options);
    ASSERT_EQ(result.axes.size(), 1u);
    const Point3 along = rotate(motion.rotation, {0.0, 0.0, 1.0});
    EXPECT_GT(std::abs(dot(result.axes[0].direction, along)), 0.999);
    const Point3 off = result.axes[0].point - motion.translation;
    EXPECT_LT(length(off - dot(off, along) * along), 0.03);
}

TEST(Fit, ABallMayBeTurnedAnyWay) {
    FitOptions options;
    options.kinds = FitKinds::only(FitKind::kWhole);
    const FitResult result = fitted(*sampleBoundary(makeSphere().solid, 20000, 1),
                                    *sampleBoundary(makeSphere().solid, 20000, 2), options);
    EXPECT_EQ(result.axes.size(), 3u);
    EXPECT_TRUE(result.alternatives.empty());
}

TEST(Fit, ReturnsEquallyGoodPoses) {
    // A box laid on itself: four ways without reflection, and no axis.
    FitOptions options;
    options.kinds = FitKinds::only(FitKind::kWhole);
    options.reflection = false;
    const PointCloud other = *sampleBoundary(makeBox().solid, 20000, 1);
    const Motion motion = anyMotion(6, false, 1.0);
    const FitResult result =
        fitted(applyToCloud(motion, *sampleBoundary(makeBox().solid, 20000, 2)), other, options);
    EXPECT_TRUE(result.axes.empty());
    EXPECT_EQ(result.alternatives.size(), 3u);
    EXPECT_LT(result.certainty, 0.03);
    for (const FitPose& pose : result.alternatives) {
        EXPECT_LE(pose.score, result.best.score);
        EXPECT_LT(twoWayError(other, pose.motion, motion), 0.02);
    }
    // Mirrored ones are as good; no more than promised are returned.
    options.reflection = true;
    const FitResult either =
        fitted(applyToCloud(motion, *sampleBoundary(makeBox().solid, 20000, 2)), other, options);
    EXPECT_TRUE(either.handednessOpen);
    EXPECT_GE(either.alternatives.size(), 3u);
    EXPECT_LE(either.alternatives.size(), kMostAlternatives);
    options.reflection = false;
    const FitResult sure = fitted(scanOfMember("human", 1, 1), scanOfMember("human", 1, 2), options);
    EXPECT_TRUE(sure.alternatives.empty());
    EXPECT_GT(sure.certainty, 0.1);
}

TEST(Fit, ScoresUnrelatedShapesLower) {
    FitOptions options;
    options.kinds = FitKinds::only(FitKind::kWhole);
    const PointCloud query = scanOfMember("chair", 0, 1);
    const double own = fitted(query, scanOfMember("chair", 0, 2), options).best.score;
    for (const char* family : {"animal", "bottle", "fish"}) {
        EXPECT_LT(fitted(query, scanOfMember(family, 0, 2), options).best.score, 0.7 * own) << family;
    }
}

TEST(Fit, ChoosesTheKindOfTheQuery) {
    const PointCloud scan = scanOfMember("human", 1, 1);
    const PointCloud other = scanOfMember("human", 1, 2);
    EXPECT_EQ(fitted(scan, other, {}).kind, FitKind::kWhole);
    for (const FitKind kind : {FitKind::kOneSided, FitKind::kPiece}) {
        const FitResult result = fitted(damaged(scan, kind, 3), other, {});
        EXPECT_LT(twoWayError(other, result.best.motion, {}), 0.02) << static_cast<int>(kind);
    }
}

TEST(Fit, DoesNotDependOnThreadsOrPointOrder) {
    const PointCloud scan = scanOfMember("airplane", 0, 1);
    const PointCloud other = scanOfMember("airplane", 0, 2);
    const FitResult once = fitted(scan, other, {});
    const FitResult shuffled =
        fitted(testing_support::shuffled(scan, 5), testing_support::shuffled(other, 6), {});
    const auto same = [&](const FitResult& again) {
        EXPECT_EQ(once.best.motion.rotation, again.best.motion.rotation);
        EXPECT_EQ(once.best.motion.translation, again.best.motion.translation);
        EXPECT_EQ(once.best.motion.scale, again.best.motion.scale);
        EXPECT_EQ(once.best.score, again.best.score);
        EXPECT_EQ(once.certainty, again.certainty);
        EXPECT_EQ(once.alternatives.size(), again.alternatives.size());
    };
    same(shuffled);
    const FitQuery query(surfaceOf(scan));
    const SurfacePoints candidate = *decodeSurfacePoints(encodeSurfacePoints(surfaceOf(other)));
    std::vector<FitResult> many(6);
    ASSERT_TRUE(parallelFor(many.size(), 1, {}, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) many[i] = *fit(query, candidate);
    }));
    for (const FitResult& result : many) same(result);
    tbb::task_arena(1).execute([&] { same(*fit(query, candidate)); });
}

TEST(Fit, SurvivesDegenerateShapes) {
    Random random(7);
    PointCloud flat;
    for (int i = 0; i < 2000; ++i) flat.push_back({random.uniform(), 0.3 * random.uniform(), 0.0});
    PointCloud four = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    PointCloud needle;
    for (int i = 0; i < 500; ++i)
        needle.push_back({0.01 * i, 1e-4 * random.uniform(), 1e-4 * random.uniform()});
    PointCloud huge;
    for (const Point3& p : scanOfMember("fish", 0, 1)) huge.push_back(1e37 * p);
    const PointCloud normal = scanOfMember("fish", 0, 2);
    std::vector<SurfacePoints> shapes;
    for (const PointCloud& scan : {flat, four, needle, huge, normal}) shapes.push_back(surfaceOf(scan));
    for (const SurfacePoints& query : shapes) {
        const FitQuery prepared(query);
        for (const SurfacePoints& other : shapes) {
            for (const FitKind kind : {FitKind::kWhole, FitKind::kOneSided, FitKind::kPiece}) {
                for (const bool keepScale : {false, true}) {
                    const auto result = fit(prepared, other, {FitKinds::only(kind), keepScale, true});
                    ASSERT_TRUE(result) << result.error().message;
                    const FitPose& best = result->best;
                    EXPECT_GE(best.score, 0.0);
                    EXPECT_LE(best.score, 1.0);
                    EXPECT_TRUE(std::isfinite(best.motion.scale) && best.motion.scale > 0.0);
                    EXPECT_TRUE(isFinite(best.motion.translation));
                    EXPECT_TRUE(std::isfinite(best.residual));
                    EXPECT_NEAR(std::abs(determinant(best.motion.rotation)), 1.0, 1e-6);
                    EXPECT_GE(result->certainty, 0.0);
                    EXPECT_LE(result->certainty, 1.0);
                }
            }
        }
    }
    FitOptions whole;
    whole.kinds = FitKinds::only(FitKind::kWhole);
    EXPECT_GT(fitted(huge, normal, whole).best.score, 0.7);
    EXPECT_GT(fitted(flat, flat, whole).best.score, 0.9);
}

TEST(Fit, StopsWhenCancelledOrPastItsDeadline) {
    const SurfacePoints surface = surfaceOf(scanOfMember("fish", 0, 1));
    const FitQuery query(surface);
    const std::atomic<bool> cancel{true};
    RunContext cancelled;
    cancelled.cancel = &cancel;
    EXPECT_EQ(fit(query, surface, {}, cancelled).error().code, ErrorCode::kCancelled);
    RunContext late;
    late.deadline = RunContext::Clock::now();
    EXPECT_EQ(fit(query, surface, {}, late).error().code, ErrorCode::kDeadlineExceeded);
    // Also in the middle of the work.
    std::atomic<bool> later{false};
    RunContext midway;
    midway.cancel = &later;
    midway.progress = [&](const char*, std::uint64_t, std::uint64_t) { later = true; };
    EXPECT_EQ(fit(query, surface, {}, midway).error().code, ErrorCode::kCancelled);
}

TEST(Fit, ReportsProgress) {
    const SurfacePoints surface = surfaceOf(scanOfMember("fish", 0, 1));
    RunContext context;
    std::uint64_t last = 0;
    std::uint64_t total = 0;
    context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t of) {
        EXPECT_STREQ(stage, "fit");
        EXPECT_GE(done, last);
        last = done;
        total = of;
    };
    ASSERT_TRUE(fit(FitQuery(surface), surface, {}, context));
    EXPECT_GT(total, 0u);
    EXPECT_EQ(last, total);
}

TEST(Fit, AnyRatioOfSizesThatAreKeptHasAResult) {
    const PointCloud query = scanOf(makeMember("animal", 1, 1).value(), {}).value();
    for (const double ratio : {1e-6, 1e-3, 0.002, 0.01, 0.1, 10.0, 100.0, 300.0, 990.0, 1e3, 1e6}) {
        Motion motion;
        motion.scale = ratio;
        const SurfacePoints other = surfaceOf(applyToCloud(motion, query));
        for (const FitKind kind : {FitKind::kWhole, FitKind::kOneSided, FitKind::kPiece}) {
            FitOptions options;
            options.kinds = FitKinds::only(kind);
            options.keepScale = true;
            const auto found = fit(FitQuery(surfaceOf(query)), other, options);
            ASSERT_TRUE(found) << ratio;
            EXPECT_EQ(found->best.motion.scale, 1.0) << ratio;
            if (ratio <= 0.01 || ratio >= 100.0) {
                EXPECT_LT(found->best.score, 0.3) << ratio;
            }
        }
    }
}

}  // namespace
}  // namespace shapedb
