// SPDX-License-Identifier: GPL-3.0-or-later
// Scans that lie far from the origin of their coordinates, through the commands.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "client/io/ply_writer.h"
#include "client/io/scan_reader.h"
#include "core/geometry/box.h"
#include "core/geometry/motion.h"
#include "tests/client/cli/online_fixture.h"

namespace shapedb::cli {
namespace {

using nlohmann::json;

using OnlineOrigins = Online;

/// The largest distance of a point that a row-major 4 x 4 of JSON moves from where it should be.
double worst(const json& matrix, const PointCloud& from, const PointCloud& to) {
    double worst = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        const Point3& p = from[i];
        const auto row = [&](int r) {
            const auto at = [&](int c) { return matrix[static_cast<std::size_t>(4 * r + c)].get<double>(); };
            return at(0) * p.x + at(1) * p.y + at(2) * p.z + at(3);
        };
        worst = std::max(worst, distance({row(0), row(1), row(2)}, to[i]));
    }
    return worst;
}

std::string xyzText(const PointCloud& points) {
    std::string text;
    for (const Point3& p : points) {
        char line[120];
        std::snprintf(line, sizeof line, "%.9f %.9f %.9f\n", p.x, p.y, p.z);
        text += line;
    }
    return text;
}

// What comes back is where the files have it, whatever the uploads subtracted.
TEST_F(OnlineOrigins, SurveyedCoordinatesAreThoseOfTheFiles) {
    onlineJson({"collection", "create", "survey"});
    const PointCloud local = readScan(scans() + "/mug/mug_01.ply").value().points;
    const double size = boxOf(local).diagonal();
    const auto placed = [&](double angle, const Point3& at) {
        Motion motion;
        motion.rotation = rotationAboutAxis(2, angle);
        motion.translation = at;
        return applyToCloud(motion, local);
    };
    const PointCloud one = placed(0.4, size * Point3{2.2e6, -2.6e6, 60.5});
    const PointCloud two = placed(1.9, size * Point3{-3.1e6, 1.7e6, 9.25});
    write("local.xyz", xyzText(local));
    write("one.xyz", xyzText(one));
    write("two.xyz", xyzText(two));
    onlineJson(
        {"add", path("local.xyz"), path("one.xyz"), "--base", folder(), "--collection", "survey", "--wait"});
    const json shape = onlineJson({"get", "one", "--collection", "survey"});
    EXPECT_NEAR(shape["origin"][0].get<double>(), size * 2.2e6, 3.0 * size);
    EXPECT_FALSE(shape["metadata"].contains("shapedb.offset"));
    EXPECT_FALSE(onlineJson({"get", "local", "--collection", "survey"}).contains("origin"));
    EXPECT_NE(online({"get", "one", "--collection", "survey"}).out.find("sent relative to"),
              std::string::npos);

    const json found = onlineJson({"query", path("two.xyz"), "--collection", "survey"});
    ASSERT_EQ(found["hits"].size(), 2u);
    EXPECT_FALSE(found.contains("offset"));
    for (const json& hit : found["hits"]) {
        const PointCloud& stored = hit["key"] == "one" ? one : local;
        EXPECT_EQ(hit["matrix"], hit["fit"]["matrix"]) << "one motion, told twice";
        EXPECT_LT(worst(hit["fit"]["matrix"], stored, two), 0.04 * size) << hit["key"];
        EXPECT_EQ(hit["verdict"], "same_object");
    }
    EXPECT_LT(distance({found["query"]["points"][0]["position"][0].get<double>(),
                        found["query"]["points"][0]["position"][1].get<double>(),
                        found["query"]["points"][0]["position"][2].get<double>()},
                       two[0]),
              size);
    const json compared = onlineJson({"compare", "local", "one", "--collection", "survey"});
    EXPECT_GT(compared["score"].get<double>(), 0.9);
    EXPECT_LT(worst(compared["fit"]["matrix"], one, local), 0.04 * size);
    const json aligned = onlineJson({"align", path("two.xyz"), "--key", "one", "--collection", "survey"});
    EXPECT_LT(worst(aligned["matrix"], one, two), 0.04 * size);
    EXPECT_LT(worst(onlineJson({"align", path("two.xyz"), path("one.xyz")})["matrix"], one, two),
              0.04 * size);

    // Points as they were sent, and coloured by part.
    for (const bool coloured : {false, true}) {
        std::vector<std::string> get = {"get", "one", "--collection", "survey", "--out", path("out.ply")};
        if (!coloured) get.emplace_back("--points");
        onlineJson(get);
        const PointCloud back = readScan(path("out.ply")).value().points;
        ASSERT_EQ(back.size(), one.size());
        for (std::size_t i = 0; i < back.size(); ++i) EXPECT_LT(distance(back[i], one[i]), 2e-6 * size);
    }
}

TEST_F(OnlineOrigins, AnOutlierDoesNotChooseTheOrigin) {
    onlineJson({"collection", "create", "outliers"});
    const PointCloud local = readScan(scans() + "/mug/mug_01.ply").value().points;
    // Far, but not so far that all the rest is one point beside the outlier.
    const double scale = 300.0 / boxOf(local).diagonal();
    const Point3 at{4.4e6, -5.2e6, 120.0};
    PointCloud surveyed;
    for (const Point3& p : local) surveyed.push_back(at + scale * p);
    write("clean.xyz", xyzText(surveyed));
    surveyed.insert(surveyed.begin(), Point3{});
    write("outlier.xyz", xyzText(surveyed));
    onlineJson({"add", path("clean.xyz"), path("outlier.xyz"), "--base", folder(), "--collection", "outliers",
                "--wait"});
    const json shape = onlineJson({"get", "outlier", "--collection", "outliers"});
    EXPECT_NEAR(shape["origin"][0].get<double>(), at.x, 300.0);
    EXPECT_GT(onlineJson({"compare", "clean", "outlier", "--collection", "outliers"})["score"].get<double>(),
              0.8);
}

TEST_F(OnlineOrigins, AFileThatHasLostItsShapeIsRefused) {
    PointCloud far = dumbbellPoints(2000);
    for (Point3& p : far) p = p + Point3{4.5e6, 5.4e6, 312.5};
    ASSERT_TRUE(writePointsPly(path("lost.ply"), far, PlyPrecision::kSingle));
    ASSERT_TRUE(writePointsPly(path("kept.ply"), far, PlyPrecision::kDouble));
    for (const std::string command : {"query", "segment"}) {
        const CommandRun run = online({command, path("lost.ply")});
        EXPECT_NE(run.exitCode, 0) << command;
        EXPECT_NE(run.err.find("lost.ply: coordinates up to 5.4e+06 are 0.5 apart"), std::string::npos)
            << run.err;
    }
    EXPECT_EQ(onlineJson({"add", path("lost.ply")}, 3)["failed"][0]["error"]["name"],
              "coordinate_out_of_range");
    EXPECT_GT(runCommand({"segment", path("kept.ply"), "--json"}).json()["quality"].get<double>(), 0.8);
}

}  // namespace
}  // namespace shapedb::cli
