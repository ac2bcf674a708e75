// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <ostream>

#include "client/io/scan_reader.h"
#include "core/base/math.h"
#include "core/pipeline.h"
#include "core/synthetic/degrade.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

class SegmentCommand : public CommandTest {
  protected:
    std::string dumbbell() const { return writePoints("dumbbell.xyz", dumbbellPoints()); }
};

/// Without values that differ from run to run.
nlohmann::json timeless(nlohmann::json document) {
    for (const char* key : {"delaunay_seconds", "total_seconds", "stages"}) document.erase(key);
    return document;
}

TEST_F(SegmentCommand, JsonHasThePromisedKeys) {
    const CommandRun run = runCommand({"segment", dumbbell(), "--json", "--profile", "paper"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.err, "");
    const auto document = run.json();
    for (const char* key :
         {"points", "tetrahedra", "segments", "volume", "delaunay_seconds", "total_seconds"}) {
        ASSERT_TRUE(document.contains(key)) << key;
        EXPECT_GT(document[key].get<double>(), 0.0) << key;
    }
    EXPECT_EQ(document["points"], dumbbellPoints().size());
    const auto& signature = document["signature"];
    ASSERT_TRUE(signature.is_array());
    ASSERT_GE(signature.size(), 2u);
    double last = signature[0]["weight"];
    double sum = 0.0;
    for (const auto& point : signature) {
        ASSERT_EQ(point["position"].size(), 3u);
        ASSERT_EQ(point["extents"].size(), 3u);
        EXPECT_GT(point["peak_radius"].get<double>(), 0.0);
        EXPECT_LE(point["weight"].get<double>(), last) << "in descending order of weight";
        last = point["weight"];
        sum += point["volume_share"].get<double>();
    }
    EXPECT_LE(sum, 1.0 + 1e-6);
    EXPECT_LE(document["delaunay_seconds"], document["total_seconds"]);
}

TEST_F(SegmentCommand, FindsTheTwoBallsOfADumbbell) {
    const auto document = runCommand({"segment", dumbbell(), "--json", "--profile", "paper"}).json();
    const double ball = 4.0 / 3.0 * kPi;
    for (int i = 0; i < 2; ++i) {
        const auto& point = document["signature"][i];
        EXPECT_NEAR(point["weight"].get<double>(), ball, 0.1 * ball);
        EXPECT_NEAR(std::abs(point["position"][0].get<double>()), 1.4, 0.1);
        EXPECT_NEAR(point["peak_radius"].get<double>(), 1.0, 0.05);
    }
}

TEST_F(SegmentCommand, AgreesWithTheLibrary) {
    const auto document = runCommand({"segment", dumbbell(), "--json", "--profile", "paper", "--deep-angle",
                                      "25", "--segments", "3"})
                              .json();
    auto scan = readScan(path("dumbbell.xyz"));
    ASSERT_TRUE(scan);
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    parameters.segmentation.deepAngleDegrees = 25.0;
    parameters.signature.maxPoints = 3;
    const auto expected = describe(scan->points, parameters);
    ASSERT_TRUE(expected);
    EXPECT_EQ(document["segments"], expected->segmentation.segments.size());
    EXPECT_EQ(document["volume"], expected->segmentation.volume);
    EXPECT_EQ(document["tetrahedra"], expected->segmentation.tetrahedra.size());
    EXPECT_EQ(document["signature"].size(), 3u);
    EXPECT_EQ(document["signature"][0]["weight"], pointVolume(expected->signature, 0));
}

TEST_F(SegmentCommand, FlagsBeyondThePaperReachTheMethod) {
    const std::vector<std::string> base = {"segment", dumbbell(), "--json", "--profile", "paper"};
    const auto with = [&](const std::vector<std::string>& more) {
        auto arguments = base;
        arguments.insert(arguments.end(), more.begin(), more.end());
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, 0) << run.err;
        return run.json();
    };
    const auto plain = with({});
    EXPECT_EQ(plain["parameters"]["attributes"], false);
    EXPECT_FALSE(plain.contains("statistics"));
    EXPECT_EQ(plain["quality"], 1.0);
    const auto all = with({"--interior", "adaptive", "--merge-contrast", "1.25", "--max-segments", "2",
                           "--min-segment-share", "0.01", "--outlier-ratio", "3", "--smoothing-reach", "5",
                           "--thinning", "1", "--attributes"});
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    parameters.segmentation.interiorMethod = InteriorMethod::kAdaptive;
    parameters.segmentation.mergeContrast = 1.25;
    parameters.segmentation.maxSegments = 2;
    parameters.segmentation.minSegmentShare = 0.01;
    parameters.segmentation.preparation.outlierRatio = 3.0;
    parameters.segmentation.preparation.smoothingReach = 5.0;
    parameters.segmentation.preparation.thinning = 1.0;
    parameters.signature.attributes = true;
    const auto expected = describe(readScan(path("dumbbell.xyz"))->points, parameters);
    ASSERT_TRUE(expected) << expected.error().message;
    EXPECT_EQ(all["segments"], expected->segmentation.segments.size());
    EXPECT_EQ(all["volume"], expected->segmentation.volume);
    EXPECT_EQ(all["points_used"], expected->segmentation.sites.size());
    EXPECT_EQ(all["quality"], expected->segmentation.quality);
    EXPECT_EQ(all["estimated_noise"], expected->segmentation.noise);
    EXPECT_EQ(all["statistics"].size(), kStatistics.size());
    EXPECT_FALSE(with({"--no-attributes"}).contains("statistics"));
}

TEST_F(SegmentCommand, FormerFlagNamesGiveTheSameResult) {
    const auto run = [&](const std::string& outliers, const std::string& thinning) {
        return timeless(
            runCommand({"segment", dumbbell(), "--json", outliers, "2.5", thinning, "1.5"}).json());
    };
    const auto current = run("--outlier-ratio", "--thinning");
    EXPECT_EQ(current, run("--stray-ratio", "--even-spacing"));
    EXPECT_EQ(current["strays"], current["outliers"]);
    EXPECT_EQ(current["parameters"]["stray_ratio"], 2.5);
    EXPECT_EQ(current["parameters"]["even_spacing"], 1.5);
}

TEST_F(SegmentCommand, LabelledPlyHasPointsAndLabels) {
    const CommandRun run =
        runCommand({"segment", dumbbell(), "--json", "--profile", "paper", "--out", path("out.ply")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto scan = readScan(path("dumbbell.xyz"));
    const auto expected = describe(scan->points, parametersOf(Profile::kPaper));
    ASSERT_TRUE(expected);

    std::ifstream file(path("out.ply"), std::ios::binary);
    std::string line;
    while (std::getline(file, line) && line != "end_header") {
    }
    std::map<std::int32_t, std::size_t> labels;
    for (std::size_t i = 0; i < scan->points.size(); ++i) {
        char record[19];  // float x y z, uchar red green blue, int segment
        ASSERT_TRUE(file.read(record, sizeof record)) << i;
        float x = 0.0f;
        std::int32_t label = 0;
        std::memcpy(&x, record, sizeof x);
        std::memcpy(&label, record + 15, sizeof label);
        EXPECT_EQ(x, static_cast<float>(scan->points[i].x));
        ASSERT_EQ(label, expected->segmentation.pointSegment[i]) << i;
        ++labels[label];
    }
    EXPECT_EQ(file.peek(), std::char_traits<char>::eof());
    EXPECT_GT(labels[0], 500u);
    EXPECT_GT(labels[1], 500u);
}

TEST_F(SegmentCommand, SameSeedGivesTheSameResult) {
    const std::vector<std::string> arguments = {"segment", dumbbell(), "--json", "--noise",
                                                "0.002",   "--points", "2000"};
    auto with = [&](const char* seed) {
        auto all = arguments;
        all.insert(all.end(), {"--seed", seed});
        return timeless(runCommand(all).json());
    };
    EXPECT_EQ(with("5"), with("5"));
    EXPECT_EQ(with("5")["points"], 2000);
    EXPECT_NE(with("5")["volume"], with("6")["volume"]);
}

TEST_F(SegmentCommand, TextNamesFileCountsAndSegments) {
    const CommandRun run = runCommand({"segment", dumbbell()});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("dumbbell.xyz"), std::string::npos);
    EXPECT_NE(run.out.find("parts, volume"), std::string::npos);
    EXPECT_NE(run.out.find("Largest parts:"), std::string::npos);
    EXPECT_EQ(run.out.find('\x1b'), std::string::npos) << "no terminal codes in a pipe";
    EXPECT_EQ(run.err, "");
}

TEST_F(SegmentCommand, TellsOfListsThatMayHaveBeenFaces) {
    const PointCloud points = dumbbellPoints();
    std::string ply = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(points.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nelement groups 1\n"
                      "property list uchar int members\nend_header\n";
    for (const Point3& p : points) {
        ply += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
    }
    const std::string file = write("groups.ply", ply + "2 0 1\n");
    EXPECT_NE(runCommand({"segment", file}).out.find("passed over: list members of element groups\n"),
              std::string::npos);
    EXPECT_EQ(runCommand({"segment", file, "--json"}).json()["ignored"],
              nlohmann::json::array({"list members of element groups"}));
    EXPECT_EQ(runCommand({"segment", dumbbell(), "--json"}).json()["ignored"], nlohmann::json::array());
}

struct BadScan {
    const char* name;
    const char* file;
    std::string bytes;
    const char* error;
    int exitCode;
};

// Names the parameter in the output; the default prints addresses.
void PrintTo(const BadScan& bad, std::ostream* out) { *out << bad.file; }

std::string repeated(const std::string& line, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += line;
    return text;
}

class SegmentBadScan : public SegmentCommand, public ::testing::WithParamInterface<BadScan> {};

TEST_P(SegmentBadScan, GivesItsErrorAndExitCode) {
    const BadScan& bad = GetParam();
    const std::string file = write(bad.file, bad.bytes);
    const CommandRun run = runCommand({"segment", file, "--json", "--out", path("out.ply")});
    EXPECT_EQ(run.exitCode, bad.exitCode) << run.err;
    const auto document = run.json();
    EXPECT_EQ(document["error"]["name"], bad.error);
    const std::string message = document["error"]["message"];
    EXPECT_NE(message.find(bad.file), std::string::npos) << "names the file: " << message;
    EXPECT_EQ(run.err, "shapedb: " + message + "\n");
    EXPECT_FALSE(std::ifstream(path("out.ply")).good()) << "nothing is written";
}

INSTANTIATE_TEST_SUITE_P(
    All, SegmentBadScan,
    ::testing::Values(
        BadScan{"Empty", "empty.xyz", "", "malformed_file", 3},
        BadScan{"ThreePoints", "three.xyz", "0 0 0\n1 0 0\n0 1 0\n", "too_few_points", 3},
        BadScan{"AllEqual", "equal.xyz", repeated("1 2 3\n", 100), "all_points_equal", 3},
        BadScan{"Collinear", "line.xyz", "0 0 0\n1 1 1\n2 2 2\n3 3 3\n4 4 4\n", "collinear", 3},
        BadScan{"Coplanar", "plane.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n", "coplanar", 3},
        BadScan{"NaN", "nan.xyz", "0 0 0\n1 0 0\nnan 1 0\n0 0 1\n1 1 1\n", "non_finite_coordinate", 3},
        BadScan{"NotAScan", "notes.xyz", "hello world\n", "malformed_file", 3},
        BadScan{"UnknownEnding", "scan.docx", "x", "unknown_file_format", 3},
        BadScan{"LyingHeader", "lies.ply",
                "ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\n"
                "property float z\nend_header\n0 0 0\n1 1 1\n",
                "malformed_file", 3}),
    [](const ::testing::TestParamInfo<BadScan>& bad) { return bad.param.name; });

TEST_F(SegmentCommand, ReportsMissingFileAndUnwritableOutput) {
    const CommandRun missing = runCommand({"segment", path("missing.ply"), "--json"});
    EXPECT_EQ(missing.exitCode, 3);
    EXPECT_EQ(missing.json()["error"]["name"], "file_not_readable");

    const CommandRun unwritable =
        runCommand({"segment", dumbbell(), "--json", "--out", path("no/such/folder/x.ply")});
    EXPECT_EQ(unwritable.exitCode, 3);
    EXPECT_EQ(unwritable.json()["error"]["name"], "file_not_writable");
}

TEST_F(SegmentCommand, HugeAndTinyCoordinatesGiveTheSameShape) {
    for (const double scale : {1e-6, 1e6}) {
        PointCloud points = dumbbellPoints();
        for (Point3& p : points) p = scale * p;
        const auto document = runCommand({"segment", writePoints("scaled.xyz", points), "--json"}).json();
        ASSERT_TRUE(document.contains("volume")) << document;
        EXPECT_NEAR(document["volume"].get<double>() / (scale * scale * scale), 8.5, 0.6);
    }
}

}  // namespace
}  // namespace shapedb::cli
