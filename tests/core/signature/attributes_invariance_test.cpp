// SPDX-License-Identifier: GPL-3.0-or-later
// What must not change the attributes of a signature, and how little noise may change them.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/signature/moved_scans.h"

namespace shapedb {
namespace {

using testing_support::anyMotion;
using testing_support::shuffled;

constexpr std::size_t kPoints = 2500;

Signature describeDefault(const PointCloud& points) {
    return describe(points, parametersOf(Profile::kDefault)).value().signature;
}

// Mean difference of a bin, [0, 1], of each statistic.
std::vector<double> differences(const Signature& a, const Signature& b) {
    std::vector<double> result;
    for (const StatisticLayout& layout : kStatistics) {
        const int rows = layout.reversibleRows > 0 ? layout.reversibleRows : 1;
        const int columns = layout.count / rows;
        double straight = 0.0;
        double reversed = 0.0;
        for (int row = 0; row < rows; ++row) {
            for (int column = 0; column < columns; ++column) {
                const auto bin = [&](const Signature& s, int r) {
                    return s.attributes
                               ->statistics[static_cast<std::size_t>(layout.offset + r * columns + column)] /
                           15.0;
                };
                straight += std::abs(bin(a, row) - bin(b, row));
                reversed += std::abs(bin(a, row) - bin(b, rows - 1 - row));
            }
        }
        result.push_back((rows > 1 ? std::min(straight, reversed) : straight) / layout.count);
    }
    return result;
}

double total(const std::vector<double>& all) {
    double sum = 0.0;
    for (const double d : all) sum += d;
    return sum;
}

struct Named {
    std::string name;
    PointCloud points;
};

std::vector<Named> shapes() {
    std::vector<Named> all;
    all.push_back({"dumbbell", sampleBoundary(makeDumbbell().solid, kPoints, 1).value()});
    all.push_back({"jack", sampleBoundary(makeJack().solid, kPoints, 1).value()});
    ScanOptions options;
    options.count = kPoints;
    options.randomPose = false;
    for (const char* family : {"animal", "mug"}) {
        all.push_back({family, scanOf(makeMember(family, 0, 1).value(), options).value()});
    }
    return all;
}

TEST(AttributesInvariance, MotionsChangeStatisticsFarLessThanAnotherShape) {
    const auto all = shapes();
    std::vector<Signature> still;
    for (const Named& shape : all) still.push_back(describeDefault(shape.points));
    double nearestOther = 1e9;
    for (std::size_t i = 0; i < all.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            nearestOther = std::min(nearestOther, total(differences(still[i], still[j])));
        }
    }
    Random random(21);
    constexpr int kTurns = 3;
    for (std::size_t i = 0; i < all.size(); ++i) {
        for (int turn = 0; turn < kTurns; ++turn) {
            const Motion motion = anyMotion(random, turn, kTurns);
            const Signature moved = describeDefault(shuffled(applyToCloud(motion, all[i].points), 9U + turn));
            EXPECT_LT(total(differences(still[i], moved)), 0.3 * nearestOther) << all[i].name << " " << turn;
            EXPECT_NEAR(moved.attributes->quality, still[i].attributes->quality, 12) << all[i].name;
            EXPECT_NEAR(moved.scale / motion.scale / still[i].scale, 1.0, 0.01) << all[i].name;
        }
    }
}

TEST(AttributesInvariance, ResamplingAndNoiseChangeLessThanAnotherShape) {
    const std::vector<std::string> families = {"animal", "human", "mug", "hammer"};
    std::vector<Signature> first;
    std::vector<Signature> second;
    for (const std::string& family : families) {
        const Solid solid = makeMember(family, 0, 1).value();
        ScanOptions options;
        options.count = kPoints;
        first.push_back(describeDefault(scanOf(solid, options).value()));
        options.seed = 2;
        options.noise = 0.003;
        second.push_back(describeDefault(scanOf(solid, options).value()));
    }
    for (std::size_t i = 0; i < families.size(); ++i) {
        const double own = total(differences(first[i], second[i]));
        for (std::size_t j = 0; j < families.size(); ++j) {
            if (i == j) continue;
            EXPECT_LT(own, 0.7 * total(differences(first[i], second[j])))
                << families[i] << " " << families[j];
        }
    }
}

TEST(AttributesInvariance, PointOrderChangesNoBit) {
    for (const Named& shape : shapes()) {
        const std::string bytes = encodeSignature(describeDefault(shape.points));
        EXPECT_EQ(encodeSignature(describeDefault(shuffled(shape.points, 5))), bytes) << shape.name;
    }
}

TEST(AttributesInvariance, PowersOfTwoChangeNoBit) {
    const PointCloud points = sampleBoundary(makeJack().solid, 2000, 1).value();
    const Signature still = describeDefault(points);
    for (const int exponent : {-20, 1, 30}) {
        PointCloud scaled = points;
        for (Point3& p : scaled) p = std::ldexp(1.0, exponent) * p;
        const Signature moved = describeDefault(scaled);
        EXPECT_TRUE(sameShape(still, moved)) << exponent;
        EXPECT_EQ(moved.attributes->statistics, still.attributes->statistics);
    }
}

TEST(AttributesInvariance, AreComputedOnlyIfEnabled) {
    const PointCloud points = sampleBoundary(makeDumbbell().solid, 2000, 1).value();
    ShapeParameters parameters = parametersOf(Profile::kDefault);
    const Description with = describe(points, parameters).value();
    ASSERT_TRUE(with.signature.attributes);
    EXPECT_EQ(with.signature.attributes->quality,
              static_cast<int>(std::lround(255.0 * with.segmentation.quality)));
    parameters.signature.attributes = false;
    const Signature without = describe(points, parameters).value().signature;
    EXPECT_FALSE(without.attributes);
    EXPECT_FALSE(sameShape(without, with.signature));
    ASSERT_EQ(without.points.size(), with.signature.points.size());
    for (std::size_t i = 0; i < without.points.size(); ++i) {
        EXPECT_EQ(without.points[i].position, with.signature.points[i].position) << "the same points";
    }
    EXPECT_FALSE(parametersOf(Profile::kPaper).signature.attributes) << "as published";

    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    SignatureOptions options;
    options.attributes = true;
    EXPECT_EQ(makeSignature(with.segmentation, options, context).error().code, ErrorCode::kCancelled);
}

TEST(AttributesInvariance, SameShapeComparesAttributes) {
    const PointCloud points = sampleBoundary(makeDumbbell().solid, 2000, 1).value();
    const Signature a = describeDefault(points);
    EXPECT_TRUE(sameShape(a, a));
    const auto differs = [&](const std::function<void(Signature&)>& change) {
        Signature b = a;
        change(b);
        EXPECT_FALSE(sameShape(a, b));
        EXPECT_FALSE(sameShape(b, a));
    };
    differs([](Signature& s) { s.attributes->statistics[351] ^= 1; });
    differs([](Signature& s) { s.attributes->quality ^= 1; });
    differs([](Signature& s) { s.attributes->body.segments.back().size[3] += 1.0f / 24.0f; });
    differs([](Signature& s) { s.attributes->body.segments.back().size[0] -= 1.0f / 24.0f; });
    differs([](Signature& s) { s.attributes->body.segments.front().position[1] += 1.0f / 16384.0f; });
    differs([](Signature& s) { s.attributes->body.segments.back().share *= 0.99f; });
    differs([](Signature& s) { s.attributes->body.segments.pop_back(); });
}

}  // namespace
}  // namespace shapedb
