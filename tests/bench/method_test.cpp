// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/method.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/peers.h"
#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> namesOf(const std::vector<Method>& methods) {
    std::vector<std::string> names;
    for (const Method& method : methods) names.push_back(method.name);
    return names;
}

Features describedBy(const Method& method, const PointCloud& points, std::uint64_t seed = 1) {
    auto features = method.describe(points, seed, {});
    EXPECT_TRUE(features) << method.name << ": " << features.error().message;
    return features ? *features : Features();
}

TEST(Method, AllMethodsAreListedByName) {
    auto expected = std::vector<std::string>{"default", "paper"};
    if (!peerLibrary().empty()) {
        for (const std::string& name : peerNames()) expected.push_back(name);
    }
    expected.emplace_back("d2");
    EXPECT_EQ(namesOf(allMethods()), expected);
    EXPECT_EQ(namesOf(*methodsNamed({})), expected);
    EXPECT_THAT(namesOf(*methodsNamed({"d2", "paper"})), ElementsAre("paper", "d2"));
}

TEST(Method, AnUnknownNameIsRefusedWithAListOfNames) {
    const auto methods = methodsNamed({"d2", "d3"});
    ASSERT_FALSE(methods);
    EXPECT_EQ(methods.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(methods.error().message, ::testing::AllOf(HasSubstr("'d3'"), HasSubstr("paper")));
}

TEST(Method, APeerThatWasNotBuiltSaysHowToGetIt) {
    const auto methods = methodsNamed({"esf"});
    if (!peerLibrary().empty()) {
        EXPECT_THAT(namesOf(*methods), ElementsAre("esf"));
        return;
    }
    ASSERT_FALSE(methods);
    EXPECT_THAT(methods.error().message, HasSubstr("SHAPEDB_BENCH_PCL"));
}

TEST(Method, EveryMethodScoresARotatedScanAboveAnotherShape) {
    const PointCloud cube = boxPoints(1.0, 0.9, 0.8, 3000, 1);
    PointCloud sameCube = boxPoints(1.0, 0.9, 0.8, 3000, 2);
    const PointCloud rod = boxPoints(1.0, 0.15, 0.1, 3000, 3);
    Random random(4);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = 12.0;
    motion.translation = {30.0, -7.0, 2.0};
    sameCube = applyToCloud(motion, sameCube);
    for (const Method& method : allMethods()) {
        const Features a = describedBy(method, cube);
        const Features b = describedBy(method, sameCube);
        const Features other = describedBy(method, rod);
        EXPECT_GT(method.score(a, b), method.score(a, other)) << method.name;
        EXPECT_EQ(method.score(a, other), method.score(other, a)) << method.name;
        EXPECT_GE(method.score(a, a), method.score(a, b)) << method.name;
    }
}

TEST(Method, HistogramMethodsRefuseDegenerateClouds) {
    const PointCloud same(200, Point3{1.0, 2.0, 3.0});
    PointCloud segment;
    for (int i = 0; i < 200; ++i) segment.push_back({0.01 * i, 0.02 * i, -0.01 * i});
    for (const Method& method : allMethods()) {
        EXPECT_FALSE(method.describe(same, 1, {})) << method.name;
        EXPECT_FALSE(method.describe({}, 1, {})) << method.name;
        if (method.name == "esf") {
            const auto line = method.describe(segment, 1, {});
            ASSERT_FALSE(line) << "PCL would draw triangles without area for ever";
            EXPECT_EQ(line.error().code, ErrorCode::kCollinear);
        }
    }
}

TEST(Method, OurMethodsCanBeCancelled) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto methods = methodsNamed({"paper"});
    ASSERT_TRUE(methods);
    const auto features = methods->front().describe(boxPoints(1, 1, 1, 2000, 1), 1, context);
    ASSERT_FALSE(features);
    EXPECT_EQ(features.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb::bench
