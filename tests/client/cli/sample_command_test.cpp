// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <fstream>
#include <iterator>

#include "client/io/scan_reader.h"
#include "core/synthetic/families.h"
#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;

using SampleCommand = CommandTest;

std::string bytesOf(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

TEST_F(SampleCommand, ListsTheFamilies) {
    const auto document = runCommand({"sample", "--list", "--json"}).json();
    ASSERT_EQ(document["families"].size(), listFamilies().size());
    EXPECT_EQ(document["families"][0]["family"], listFamilies()[0].name);
}

TEST_F(SampleCommand, WritesTheFilesItReports) {
    const CommandRun run = runCommand({"sample", path("s"), "--count", "2", "--points", "600", "--families",
                                       "mug,bird", "--noise", "0.01", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto document = run.json();
    ASSERT_EQ(document["files"].size(), 4u);
    for (const char* name : {"bird/bird_01.ply", "bird/bird_02.ply", "mug/mug_01.ply", "mug/mug_02.ply"}) {
        const auto scan = readScan(path(std::string("s/") + name));
        ASSERT_TRUE(scan) << scan.error().message;
        EXPECT_EQ(scan->points.size(), 600u);
    }
    EXPECT_EQ(document["files"][0]["label"], "bird");
}

TEST_F(SampleCommand, FilesDependOnlyOnSeedAndName) {
    const auto sample = [&](const char* folder, std::vector<std::string> more) {
        more.insert(more.begin(), {"sample", path(folder), "--points", "500"});
        EXPECT_EQ(runCommand(more).exitCode, 0);
    };
    sample("a", {"--count", "3", "--families", "fish,mug"});
    sample("b", {"--count", "1", "--first", "2", "--families", "mug"});
    sample("c", {"--count", "1", "--first", "2", "--families", "mug", "--seed", "2"});
    EXPECT_EQ(bytesOf(path("a/mug/mug_02.ply")), bytesOf(path("b/mug/mug_02.ply")));
    EXPECT_NE(bytesOf(path("a/mug/mug_02.ply")), bytesOf(path("a/mug/mug_03.ply")));
    EXPECT_NE(bytesOf(path("b/mug/mug_02.ply")), bytesOf(path("c/mug/mug_02.ply")));
    EXPECT_FALSE(fs::exists(path("b/mug/mug_01.ply")));
}

TEST_F(SampleCommand, RefusesAFolderItCannotCreate) {
    write("taken", "a file, not a folder");
    const CommandRun run = runCommand({"sample", path("taken"), "--count", "1", "--json"});
    EXPECT_EQ(run.exitCode, 3);
    EXPECT_EQ(run.json()["error"]["name"], "file_not_writable");
}

}  // namespace
}  // namespace shapedb::cli
