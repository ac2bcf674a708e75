#include "server/rpc/scan_check.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/preparation/sanitise.h"
#include "server/ingest/signature_pipeline.h"

namespace shapedb::rpc {
namespace {

std::vector<float> cube(std::size_t points, std::uint64_t seed = 1) {
    Random random(seed);
    std::vector<float> xyz(3 * points);
    for (float& value : xyz) value = static_cast<float>(random.uniform(-1.0, 1.0));
    return xyz;
}

std::vector<float> flat(std::size_t points) {
    auto xyz = cube(points);
    for (std::size_t i = 2; i < xyz.size(); i += 3) xyz[i] = 0.5f;
    return xyz;
}

/// What looking at all points says.
Result<void> full(const std::vector<float>& xyz) {
    const auto sanitised = sanitise(ingest::toCloud(xyz));
    if (!sanitised) return fail(sanitised.error());
    return {};
}

void expectAsFull(const std::vector<float>& xyz) {
    const auto quick = checkUsable(xyz);
    const auto all = full(xyz);
    ASSERT_EQ(quick.has_value(), all.has_value());
    if (quick) return;
    EXPECT_EQ(quick.error().code, all.error().code);
    EXPECT_EQ(quick.error().message, all.error().message);
}

TEST(ScanCheck, TakesWhatSpansSpace) {
    EXPECT_TRUE(checkUsable(cube(4)));
    EXPECT_TRUE(checkUsable(cube(100'000)));
}

TEST(ScanCheck, RefusesAsSanitiseDoes) {
    expectAsFull({});
    expectAsFull({1, 2, 3});
    expectAsFull(flat(5'000));
    expectAsFull(std::vector<float>(300, 7.0f));
    std::vector<float> line;
    for (int i = 0; i < 1'000; ++i) {
        for (const int factor : {1, 2, 3}) line.push_back(static_cast<float>(factor * i));
    }
    expectAsFull(line);
    // Three distinct points, however often: the message counts all of them.
    std::vector<float> three;
    for (int i = 0; i < 1'000; ++i) {
        for (int axis = 0; axis < 3; ++axis) three.push_back(i % 3 == axis ? 1.0f : 0.0f);
    }
    expectAsFull(three);
}

TEST(ScanCheck, OnePointOffThePlaneIsFoundAnywhere) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{1}, std::size_t{4'321}, std::size_t{9'999}}) {
        auto xyz = flat(10'000);
        xyz[3 * at + 2] = 0.6f;
        EXPECT_TRUE(checkUsable(xyz)) << at;
    }
}

TEST(ScanCheck, OnePointTooFarIsFoundAnywhere) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{1}, std::size_t{4'321}, std::size_t{9'999}}) {
        auto xyz = cube(10'000);
        xyz[3 * at + 1] = 3.402e38f;
        expectAsFull(xyz);
        EXPECT_FALSE(checkUsable(xyz)) << at;
    }
}

}  // namespace
}  // namespace shapedb::rpc
