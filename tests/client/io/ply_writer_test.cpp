// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/io/ply_writer.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <tuple>

#include <sys/stat.h>

#include "core/base/random.h"
#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

namespace fs = std::filesystem;

using PlyWriter = FileTest;

std::string content(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

std::size_t entries(const std::string& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

// Exact in single precision.
PointCloud randomPoints(std::size_t count) {
    Random random(5);
    const auto coordinate = [&] { return static_cast<double>(random.below(1 << 24)) / 4096.0 - 2048.0; };
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) points.push_back({coordinate(), coordinate(), coordinate()});
    return points;
}

TEST_F(PlyWriter, LabelledFileHasTheseBytes) {
    ASSERT_TRUE(writeLabelledPly(path("a.ply"), {{1, 2, 3}, {-1, 0, 0.5}}, {2, -1}));
    Bytes expected;
    expected.text(
        "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property int segment\nend_header\n");
    expected.add(1.0F).add(2.0F).add(3.0F).text("\xff\xe1\x19").add(std::int32_t{2});
    expected.add(-1.0F).add(0.0F).add(0.5F).text("\x96\x96\x96").add(std::int32_t{-1});
    EXPECT_EQ(content(path("a.ply")), expected.str());
    EXPECT_EQ(entries(folder()), 1U);
}

TEST_F(PlyWriter, WrittenPointsAreReadBack) {
    const PointCloud points = randomPoints(200000);
    ASSERT_TRUE(writePointsPly(path("a.ply"), points));
    ASSERT_TRUE(writeLabelledPly(path("b.ply"), points, std::vector<std::int32_t>(points.size(), 3)));
    ASSERT_TRUE(writePointsPly(path("empty.ply"), {}));
    EXPECT_TRUE(readScan(path("a.ply"))->points == points);
    EXPECT_TRUE(readScan(path("b.ply"))->points == points);
    EXPECT_TRUE(readScan(path("empty.ply"))->points.empty());
}

TEST_F(PlyWriter, ReplacesFilesAndFollowsLinks) {
    write("real.ply", "old");
    fs::create_symlink(path("real.ply"), path("link.ply"));
    ASSERT_TRUE(writePointsPly(path("link.ply"), {{1, 2, 3}}));
    EXPECT_TRUE(fs::is_symlink(path("link.ply")));
    EXPECT_EQ(readScan(path("real.ply"))->points.size(), 1U);
    EXPECT_EQ(entries(folder()), 2U);
}

TEST_F(PlyWriter, FullDeviceIsAnError) {
    ASSERT_TRUE(fs::is_character_file("/dev/full"));
    for (const std::size_t count : {std::size_t{1}, std::size_t{300000}}) {
        const auto done = writePointsPly("/dev/full", PointCloud(count));
        ASSERT_FALSE(done);
        EXPECT_EQ(done.error().code, ErrorCode::kFileNotWritable);
        EXPECT_NE(done.error().message.find("/dev/full"), std::string::npos);
    }
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(PlyWriter, UnwritablePathsAreNamedAndLeaveNoFile) {
    for (const std::string& place : {path("no/such/folder/a.ply"), folder(), std::string()}) {
        const auto done = writePointsPly(place, {{1, 2, 3}});
        ASSERT_FALSE(done) << place;
        EXPECT_EQ(done.error().code, ErrorCode::kFileNotWritable) << done.error().message;
        EXPECT_NE(done.error().message.find(place), std::string::npos);
    }
    EXPECT_EQ(entries(folder()), 0U);
}

TEST_F(PlyWriter, BadValuesLeaveTheOldFile) {
    write("a.ply", "old");
    const auto expectRefused = [&](const PointCloud& points, const std::vector<std::int32_t>& labels,
                                   ErrorCode code) {
        const auto done = writeLabelledPly(path("a.ply"), points, labels);
        ASSERT_FALSE(done);
        EXPECT_EQ(done.error().code, code) << done.error().message;
        EXPECT_EQ(content(path("a.ply")), "old");
        EXPECT_EQ(entries(folder()), 1U);
    };
    expectRefused({{1, 2, 3}}, {}, ErrorCode::kInvalidArgument);
    expectRefused({{1, 2, 3}, {1, std::nan(""), 3}}, {0, 0}, ErrorCode::kNonFiniteCoordinate);
    expectRefused({{1, 2, -1e39}}, {0}, ErrorCode::kCoordinateOutOfRange);
    EXPECT_TRUE(
        writePointsPly(path("a.ply"), {{static_cast<double>(std::numeric_limits<float>::max()), 0, 0}}));
}

TEST(SegmentColour, ColoursAreDistinctStableAndNeverGrey) {
    const auto distance = [](const Rgb& a, const Rgb& b) {
        return std::hypot(a.red - b.red, a.green - b.green, a.blue - b.blue);
    };
    const Rgb grey = segmentColour(-1);
    EXPECT_EQ(distance(grey, segmentColour(std::numeric_limits<std::int32_t>::min())), 0.0);
    for (std::int32_t a = 0; a < 18; ++a) {
        EXPECT_GT(distance(segmentColour(a), grey), 60.0) << a;
        for (std::int32_t b = 0; b < a; ++b) {
            EXPECT_GT(distance(segmentColour(a), segmentColour(b)), 50.0) << a << " " << b;
        }
    }
    std::set<std::tuple<int, int, int>> seen;
    constexpr std::int32_t kMany = 300;
    for (std::int32_t label = 0; label < kMany; ++label) {
        const Rgb c = segmentColour(label);
        EXPECT_GT(distance(c, grey), 40.0) << label;
        EXPECT_TRUE(seen.insert({c.red, c.green, c.blue}).second) << label;
    }
    const Rgb last = segmentColour(std::numeric_limits<std::int32_t>::max());
    EXPECT_EQ(distance(last, segmentColour(std::numeric_limits<std::int32_t>::max())), 0.0);
}

}  // namespace
}  // namespace shapedb
