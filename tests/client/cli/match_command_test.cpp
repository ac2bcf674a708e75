// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb match`: which scan of one folder belongs to which of another.
#include <filesystem>
#include <fstream>
#include <iterator>

#include "client/cli/console.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

using MatchCommand = CommandTest;

TEST_F(MatchCommand, FindsTheOtherScanOfEachObject) {
    ASSERT_EQ(
        runCommand({"sample", path("b"), "--count", "2", "--points", "3000", "--families", "human,mug,fish"})
            .exitCode,
        0);
    // The same objects scanned again, under other names, and one of which there is no other.
    const std::vector<std::string> names = {"human/human_01", "mug/mug_02", "fish/fish_01"};
    ASSERT_EQ(runCommand({"sample", path("again"), "--count", "2", "--points", "2500", "--noise", "0.003",
                          "--seed", "1", "--families", "human,mug,fish"})
                  .exitCode,
              0);
    fs::create_directories(path("a"));
    for (std::size_t i = 0; i < names.size(); ++i) {
        fs::copy(path("again/" + names[i] + ".ply"), path("a/" + std::to_string(i) + ".ply"));
    }
    write("a/broken.ply", "ply\n");
    const CommandRun run = runCommand({"match", path("a"), path("b"), "--json", "-o", path("m.csv")});
    EXPECT_EQ(run.exitCode, kSomeFailed) << run.err;
    EXPECT_NE(run.err.find("broken.ply"), std::string::npos) << run.err;
    const json document = run.json();
    ASSERT_EQ(document["matches"].size(), names.size());
    EXPECT_EQ(document["failed"].size(), 1u);
    for (std::size_t i = 0; i < names.size(); ++i) {
        const json& match = document["matches"][i];
        EXPECT_EQ(match["partner"], path("b/" + names[i] + ".ply")) << match;
        EXPECT_GE(match["score"], match["next_score"]);
        EXPECT_EQ(match["mutual"], true);
        EXPECT_EQ(match["matrix"].size(), 16u);
        EXPECT_TRUE(match["verdict"].is_string());
    }
    std::ifstream stream(path("m.csv"));
    const std::string csv{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    EXPECT_EQ(csv.rfind("file,partner,score,next_score,mutual,verdict,mirrored,residual\n", 0), 0u) << csv;
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);

    const CommandRun text = runCommand({"match", path("a/0.ply"), path("b"), "--threshold", "0.999"});
    EXPECT_EQ(text.exitCode, kOk) << text.err;
    EXPECT_NE(text.out.find("(none)"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("0 scans have a partner among 6 scans"), std::string::npos) << text.out;
    EXPECT_EQ(runCommand({"match", path("a"), path("nowhere")}).exitCode, kBadData);
}

}  // namespace
}  // namespace shapedb::cli
