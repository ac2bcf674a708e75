// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb align`: the matrix and the moved scan, near the origin and far from it.
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "client/io/ply_writer.h"
#include "client/io/scan_reader.h"
#include "core/geometry/motion.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

/// Something without symmetries.
PointCloud lopsided() {
    PointCloud points = dumbbellPoints(4000);
    for (Point3& p : points) {
        if (p.x > 0.3) p = {p.x, 0.6 * p.y, 0.8 * p.z + 0.4 * (p.x - 0.3)};
    }
    for (int i = 0; i < 600; ++i) {
        const double t = i / 600.0;
        points.push_back({-1.4 + 0.1 * std::cos(40.0 * t), 1.0 + 1.1 * t, 0.1 * std::sin(40.0 * t)});
    }
    return points;
}

class AlignCommand : public CommandTest {
  protected:
    /// A and the same elsewhere, both with all their digits.
    void writeBoth(const Point3& origin) {
        const PointCloud shape = lopsided();
        for (const Point3& p : shape) a_.push_back(p + origin);
        Motion motion;
        motion.rotation = rotationAbout({0.6, 0.0, 0.8}, 1.1);
        motion.translation = {3.0, -2.0, 1.0};
        for (const Point3& p : shape) b_.push_back(apply(motion, p) + origin);
        ASSERT_TRUE(writePointsPly(path("a.ply"), a_, PlyPrecision::kDouble));
        ASSERT_TRUE(writePointsPly(path("b.ply"), b_, PlyPrecision::kDouble));
    }
    std::string slurp(const std::string& name) const {
        std::ifstream stream(path(name));
        return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }

    PointCloud a_;
    PointCloud b_;
};

TEST_F(AlignCommand, MovesTheScanAndWritesTheMatrix) {
    for (const Point3& origin : {Point3{0.0, 0.0, 0.0}, Point3{4'512'345.0, 5'412'345.0, 230.0}}) {
        a_.clear();
        b_.clear();
        writeBoth(origin);
        const CommandRun run = runCommand({"align", path("a.ply"), path("b.ply"), "--keep-scale", "-o",
                                           path("moved.ply"), "--matrix", path("matrix.txt"), "--json"});
        ASSERT_EQ(run.exitCode, 0) << run.err;
        const auto document = run.json();
        EXPECT_EQ(document["out"], path("moved.ply"));
        EXPECT_EQ(document["matrix_file"], path("matrix.txt"));
        EXPECT_GT(document["explained_other"], 0.9);
        EXPECT_LT(document["residual"], 0.01);

        const auto moved = readScan(path("moved.ply"));
        ASSERT_TRUE(moved) << moved.error().message;
        ASSERT_EQ(moved->points.size(), a_.size());
        std::istringstream lines(slurp("matrix.txt"));
        double m[16];
        for (double& number : m) ASSERT_TRUE(lines >> number);
        std::string rest;
        EXPECT_FALSE(lines >> rest) << rest;
        for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(m[i], document["matrix"][i]) << "all digits";
        double largest = 0.0;
        for (std::size_t i = 0; i < a_.size(); ++i) {
            largest = std::max(largest, length(moved->points[i] - a_[i]));
            // The matrix says the same, as far as numbers of this size can.
            const Point3 p{m[0] * b_[i].x + m[1] * b_[i].y + m[2] * b_[i].z + m[3],
                           m[4] * b_[i].x + m[5] * b_[i].y + m[6] * b_[i].z + m[7],
                           m[8] * b_[i].x + m[9] * b_[i].y + m[10] * b_[i].z + m[11]};
            EXPECT_LT(length(p - moved->points[i]), 1e-7);
        }
        EXPECT_LT(largest, 0.05) << "a hundredth of the size";
    }
}

TEST_F(AlignCommand, TextHasTheMatrix) {
    writeBoth({});
    const CommandRun run = runCommand({"align", path("a.ply"), path("b.ply"), "-o", path("moved.ply")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("Matrix, from coordinates of " + path("b.ply")), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("\n0 0 0 1\n"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("moved: " + path("moved.ply")), std::string::npos) << run.out;
}

TEST_F(AlignCommand, WritesNothingButWhatTheNameSays) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"align", "a.ply", "b.ply", "-o", "x.obj"},
          {"segment", "a.ply", "--out", "x.obj"},
          {"get", "a", "--out", "x.xyz"},
          {"query", "a.ply", "-o", "hits.json"},
          {"report", "a.ply", "-o", "report.pdf"},
          {"match", "a", "b", "-o", "x.tsv"}}) {
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, 2) << arguments[0];
        EXPECT_NE(run.err.find("cannot be written: only ."), std::string::npos) << run.err;
    }
}

}  // namespace
}  // namespace shapedb::cli
