// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/scan_source.h"

#include <filesystem>
#include <set>

#include "core/synthetic/degrade.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

using ScanSource = CommandTest;

TEST_F(ScanSource, FileSeedDependsOnSeedAndNameAlone) {
    EXPECT_EQ(fileSeed(1, "Hand/193.ply"), fileSeed(1, "Hand/193.ply"));
    std::set<std::uint64_t> seeds;
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        for (const char* name : {"", "a", "b", "ab", "ba", "Hand/193.ply", "Hand/194.ply"}) {
            seeds.insert(fileSeed(seed, name));
        }
    }
    EXPECT_EQ(seeds.size(), 21u);
}

TEST_F(ScanSource, NameIsRelativeToTheFolder) {
    EXPECT_EQ(relativeName("scans/Hand/193.ply", "scans"), "Hand/193.ply");
    EXPECT_EQ(relativeName("scans/Hand/193.ply", "scans/"), "Hand/193.ply");
    EXPECT_EQ(relativeName("./scans/Hand/193.ply", "scans/./"), "Hand/193.ply");
    EXPECT_EQ(relativeName("scans/Hand/193.ply", "scans/Hand/193.ply"), "193.ply");
    EXPECT_EQ(relativeName("/a/b/c.ply", "/a"), "b/c.ply");
}

TEST_F(ScanSource, KeyLosesOnlyTheLastEnding) {
    EXPECT_EQ(withoutScanEnding("Hand/193.ply"), "Hand/193");
    EXPECT_EQ(withoutScanEnding("193.ply"), "193");
    EXPECT_EQ(withoutScanEnding("v1.2/cup.final.ply"), "v1.2/cup.final");
}

TEST_F(ScanSource, WithoutFlagsPointsAreThoseOfTheFile) {
    const PointCloud points = ellipsoidPoints(1.0, 0.5, 0.25, 50);
    const auto scan = loadScan(writePoints("a.xyz", points), {}, 7);
    ASSERT_TRUE(scan) << scan.error().message;
    ASSERT_EQ(scan->points.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT(distance(scan->points[i], points[i]), 1e-8);
}

TEST_F(ScanSource, NoiseAndSubsetAreDeterministicAndIndependent) {
    const std::string file = writePoints("a.xyz", ellipsoidPoints(1.0, 0.5, 0.25, 400));
    ScanFlags noisy;
    noisy.noise = 0.01;
    noisy.points = 100;
    const auto first = loadScan(file, noisy, 7);
    const auto again = loadScan(file, noisy, 7);
    const auto other = loadScan(file, noisy, 8);
    ASSERT_TRUE(first && again && other);
    EXPECT_EQ(first->points.size(), 100u);
    EXPECT_EQ(first->points, again->points);
    EXPECT_NE(first->points, other->points);

    // The same subset with noise: every point moved, none far.
    ScanFlags clean = noisy;
    clean.noise = 0.0;
    const auto subset = loadScan(file, clean, 7);
    ASSERT_TRUE(subset);
    for (std::size_t i = 0; i < 100; ++i) {
        EXPECT_NE(subset->points[i], first->points[i]);
        EXPECT_LT(distance(subset->points[i], first->points[i]), 0.01 * 2.3 * 6.0) << "six sigma";
    }
}

TEST_F(ScanSource, RefusesASubsetBelowFourPoints) {
    ScanFlags flags;
    flags.points = 3;
    const auto scan = loadScan(writePoints("a.xyz", ellipsoidPoints(1, 1, 1, 50)), flags, 1);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ScanSource, ErrorsNameTheFile) {
    const auto scan = loadScan(path("missing.ply"), {}, 1);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kFileNotReadable);
    EXPECT_NE(scan.error().message.find("missing.ply"), std::string::npos);
}

TEST_F(ScanSource, AKeyDoesNotDependOnHowThePathWasTyped) {
    const std::string here = std::filesystem::current_path().generic_string();
    for (const std::string typed :
         {"scans/cup/1.ply", "./scans//cup/1.ply", "scans/jug/../cup/1.ply", "scans/cup/./1.ply"}) {
        EXPECT_EQ(keyOfFile(typed, "").value(), "scans/cup/1") << typed;
        EXPECT_EQ(keyOfFile(here + "/" + typed, "").value(), "scans/cup/1") << typed;
        for (const std::string base : {"scans", "scans/", "./scans", "other/../scans"}) {
            EXPECT_EQ(keyOfFile(typed, base).value(), "cup/1") << typed << " below " << base;
            EXPECT_EQ(keyOfFile(here + "/" + typed, here + "/" + base).value(), "cup/1");
        }
    }
    EXPECT_EQ(keyOfFile("scans/jug/1.ply", "").value(), "scans/jug/1") << "the same name in another folder";
    EXPECT_EQ(keyOfFile("/data/cup/1.ply", "").value(), "data/cup/1") << "elsewhere: the whole path";
    EXPECT_EQ(keyOfFile("/data/cup/1.ply", "/").value(), "data/cup/1");
    EXPECT_EQ(keyOfFile("/data/cup/1.ply", "/", true).value(), "data/cup/1.ply");
    EXPECT_EQ(keyOfFile("scans/cup/1.ply.gz", "", true).value(), "scans/cup/1.ply.gz");
    EXPECT_EQ(keyOfFile("/data/cup/1.ply", "/data/jug").error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(keyOfFile("/database/1.ply", "/data").error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace shapedb::cli
