// SPDX-License-Identifier: GPL-3.0-or-later
// Units of length, tables and mirror images in the commands that need a server, against a real shapedbd.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <sys/stat.h>

#include "client/cli/console.h"
#include "client/io/scan_reader.h"
#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "tests/client/cli/online_fixture.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

using OnlineLengths = Online;

/// Two balls of different sizes on a table.
std::string twoBallsOnATable() {
    std::ostringstream out;
    Random random(3);
    const auto put = [&](const Point3& p) { out << p.x << " " << p.y << " " << p.z << "\n"; };
    for (int i = 0; i < 6000; ++i) {
        const Point3 direction = randomDirection(random);
        const bool large = i % 3 != 0;
        put((large ? 1.0 : 0.6) * direction + Point3{large ? 0.0 : 4.0, 0.0, large ? 1.0 : 0.6});
        put({random.uniform(-4.0, 8.0), random.uniform(-4.0, 4.0), 0.002 * random.normal()});
    }
    return out.str();
}

TEST_F(OnlineLengths, UnitsConvertScansAndAnswersAndMakeSizesCount) {
    onlineJson({"collection", "create", "metres", "--units", "m"});
    onlineJson({"add", scans(), "--base", scans(), "--collection", "metres", "--wait"});
    const std::string file = scans() + "/mug/mug_01.ply";
    // The same numbers taken for millimetres: a thousandth of the size.
    const json tiny = onlineJson({"query", file, "--collection", "metres", "-k", "1", "--unit", "mm"});
    EXPECT_LT(tiny["hits"][0]["score"], 0.3) << "sizes count";
    const json free =
        onlineJson({"query", file, "--collection", "metres", "-k", "1", "--unit", "mm", "--free-scale"});
    EXPECT_EQ(free["hits"][0]["key"], "mug/mug_01");
    EXPECT_GT(free["hits"][0]["score"], 0.9);
    EXPECT_EQ(free["hits"][0]["verdict"], "same_object");
    EXPECT_GT(free["hits"][0]["verdict_reliability"], 0.5);
    EXPECT_EQ(free["unit"], "mm");
    const json plain = onlineJson({"query", file, "--collection", "metres", "-k", "1"});
    EXPECT_GT(plain["hits"][0]["score"], 0.9);
    EXPECT_NEAR(free["query"]["scale"].get<double>(), plain["query"]["scale"].get<double>(),
                1e-4 * plain["query"]["scale"].get<double>())
        << "lengths come back in millimetres";
    EXPECT_EQ(onlineJson({"collection", "get", "metres"})["parameters"]["unit"], "m");

    // A shape against itself a thousand times smaller: sizes count in compare and align as in a search.
    const auto aligned = [&](const std::vector<std::string>& flags) {
        std::vector<std::string> command = {"align", file, "--key", "mug/mug_01", "--collection", "metres"};
        command.insert(command.end(), flags.begin(), flags.end());
        return onlineJson(command);
    };
    EXPECT_LT(aligned({"--unit", "mm"})["score"], 0.3);
    const json freed = aligned({"--unit", "mm", "--free-scale"});
    EXPECT_GT(freed["score"], 0.9);
    EXPECT_NEAR(freed["scale"], 1e-3, 1e-5) << "from metres of the shape to metres of the scan";
    EXPECT_GT(aligned({})["score"], 0.9);
    EXPECT_EQ(aligned({})["scale"], 1.0) << "not scaled";
    const auto compared = [&](const std::vector<std::string>& flags) {
        std::vector<std::string> command = {"compare", "mug/mug_01", "mug/mug_02", "--collection", "metres"};
        command.insert(command.end(), flags.begin(), flags.end());
        return onlineJson(command)["fit"]["scale"].get<double>();
    };
    EXPECT_EQ(compared({}), 1.0);
    EXPECT_NE(compared({"--free-scale"}), 1.0);

    // Comparing speaks in another unit too.
    const json metres = onlineJson({"compare", "mug/mug_01", "mug/mug_02", "--collection", "metres"});
    const json millimetres =
        onlineJson({"compare", "mug/mug_01", "mug/mug_02", "--collection", "metres", "--unit", "mm"});
    EXPECT_EQ(millimetres["score"], metres["score"]);
    for (const char* side : {"query", "other"}) {
        const double scale = metres[side]["scale"];
        EXPECT_NEAR(millimetres[side]["scale"], 1e3 * scale, 1e-6 * scale) << side;
    }
    for (std::size_t i : {0u, 3u, 7u, 11u}) {
        const double entry = metres["fit"]["matrix"][i];
        EXPECT_NEAR(millimetres["fit"]["matrix"][i], (i == 0 ? 1.0 : 1e3) * entry, 1e-6 * std::abs(entry))
            << i;
    }

    onlineJson({"collection", "create", "unknown-unit"});
    const CommandRun refused = online({"query", file, "--collection", "unknown-unit", "--unit", "mm"});
    EXPECT_EQ(refused.exitCode, kUsage);
    EXPECT_NE(refused.err.find("no unit"), std::string::npos) << refused.err;
}

TEST_F(OnlineLengths, AnswersSayInWhichUnitTheirLengthsAre) {
    const std::string file = scans() + "/mug/mug_01.ply";
    for (const std::string unit : {"none", "m"}) {
        const std::string collection = "unit-" + unit;
        onlineJson({"collection", "create", collection, "--units", unit});
        onlineJson({"add", file, "--key", "mug", "--collection", collection, "--wait"});
        const json own = unit == "none" ? json(nullptr) : json(unit);
        for (const std::vector<std::string>& asked :
             {std::vector<std::string>{"query", file, "--no-verify"},
              {"query", "--key", "mug", "--include-self", "--no-verify"},
              {"compare", "mug", "mug"},
              {"align", file, "--key", "mug"}}) {
            std::vector<std::string> command = asked;
            command.insert(command.end(), {"--collection", collection});
            const json answer = onlineJson(command);
            ASSERT_TRUE(answer.contains("unit")) << asked[0];
            EXPECT_EQ(answer["unit"], own) << asked[0];
            command.insert(command.end(), {"--unit", unit == "none" ? "none" : "cm"});
            EXPECT_EQ(onlineJson(command)["unit"], unit == "none" ? json(nullptr) : json("cm")) << asked[0];
        }
    }
}

TEST_F(OnlineLengths, FilesHaveTheUnitThatTheUserSays) {
    const std::string file = scans() + "/mug/mug_01.ply";
    const auto scan = readScan(file);
    ASSERT_TRUE(scan);
    PointCloud larger = scan->points;
    for (Point3& point : larger) point = 2.0 * point;
    const std::string twice = writePoints("twice.xyz", larger);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"align", file, twice}, {"compare", "--files", file, twice}}) {
        const auto scaleOf = [&](const std::vector<std::string>& flags, const json& unit) {
            std::vector<std::string> whole = command;
            whole.insert(whole.end(), flags.begin(), flags.end());
            const json answer = onlineJson(whole);
            EXPECT_EQ(answer["unit"], unit);
            return (answer.contains("fit") ? answer["fit"] : answer)["scale"].get<double>();
        };
        EXPECT_NEAR(scaleOf({}, nullptr), 0.5, 1e-3);
        EXPECT_NEAR(scaleOf({"--unit", "none"}, nullptr), 0.5, 1e-3);
        EXPECT_EQ(scaleOf({"--unit", "mm"}, "mm"), 1.0) << "sizes count";
        EXPECT_NEAR(scaleOf({"--unit", "mm", "--free-scale"}, "mm"), 0.5, 1e-3);
        std::vector<std::string> refused = command;
        refused.emplace_back("--free-scale");
        const CommandRun run = online(refused);
        EXPECT_EQ(run.exitCode, kUsage);
        EXPECT_NE(run.err.find("unless --unit says it"), std::string::npos) << run.err;
    }
}

TEST_F(OnlineLengths, SaysWhenLeftAndRightCannotBeToldApart) {
    const std::string collection = "hands";
    onlineJson({"collection", "create", collection});
    const std::string file = scans() + "/mug/mug_01.ply";
    onlineJson({"add", file, "--key", "mug", "--collection", collection, "--wait"});
    const auto asked = [&](const std::vector<std::string>& flags) {
        std::vector<std::string> command = {"query", file, "--collection", collection};
        command.insert(command.end(), flags.begin(), flags.end());
        return command;
    };
    EXPECT_EQ(onlineJson(asked({}))["left_right_untold"], false);
    EXPECT_EQ(onlineJson(asked({"--no-reflection"}))["left_right_untold"], false)
        << "it was laid on the query";
    EXPECT_EQ(onlineJson(asked({"--no-verify"}))["left_right_untold"], false) << "nobody asked";
    EXPECT_EQ(onlineJson(asked({"--no-verify", "--no-reflection"}))["left_right_untold"], true);
    const CommandRun text = online(asked({"--no-verify", "--no-reflection"}));
    EXPECT_NE(text.out.find("mirror images score nearly alike here"), std::string::npos) << text.out;
    EXPECT_EQ(online(asked({"--no-reflection"})).out.find("mirror images"), std::string::npos);
}

TEST_F(OnlineLengths, AddEachStoresTheObjectsOfATable) {
    const std::string file = data()->path() + "/table.xyz";
    std::ofstream(file) << twoBallsOnATable();
    onlineJson({"collection", "create", "table"});
    const json added =
        onlineJson({"add", file, "--base", data()->path(), "--collection", "table", "--each", "--wait"});
    ASSERT_EQ(added["added"].size(), 2u) << added;
    EXPECT_EQ(added["added"][0]["key"], "table/1");
    EXPECT_EQ(added["added"][1]["key"], "table/2");
    EXPECT_NEAR(added["added"][0]["points"].get<double>(), 4000.0, 200.0);
    fs::create_directories(data()->path() + "/mixed/table");
    fs::copy_file(file, data()->path() + "/mixed/table.xyz");
    fs::copy_file(scans() + "/mug/mug_01.ply", data()->path() + "/mixed/table/1.ply");
    const CommandRun twice = online({"add", data()->path() + "/mixed", "--collection", "table", "--each"});
    EXPECT_EQ(twice.exitCode, kUsage) << "an object and a file would share the key table/1";
    const json found = onlineJson({"query", file, "--collection", "table", "--largest", "-k", "1"});
    EXPECT_NEAR(found["scene"]["plane"]["share"].get<double>(), 0.5, 0.03);
    EXPECT_EQ(found["scene"]["plane"]["removed"], true);
    EXPECT_EQ(found["scene"]["objects"].size(), 2u);
    const CommandRun text = online({"query", file, "--collection", "table", "-k", "1"});
    EXPECT_NE(text.out.find("of the points lie on one plane: --drop-plane"), std::string::npos) << text.out;
}

TEST_F(OnlineLengths, AddEachReadsAFileOnce) {
    // What comes through a pipe can be read once only.
    const std::string pipe = path("pipe.xyz");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    std::thread writer([&] { std::ofstream(pipe) << twoBallsOnATable(); });
    onlineJson({"collection", "create", "pipe"});
    const json added = onlineJson({"add", pipe, "--key", "pair", "--collection", "pipe", "--each"});
    writer.join();
    ASSERT_EQ(added["added"].size(), 2u) << added;
    EXPECT_EQ(added["added"][0]["key"], "pair/1");
    EXPECT_EQ(added["added"][1]["key"], "pair/2");
}

}  // namespace
}  // namespace shapedb::cli
