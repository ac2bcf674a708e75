// SPDX-License-Identifier: GPL-3.0-or-later
// Command lines that are refused, and what all commands have in common.
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

using Usage = CommandTest;

TEST_F(Usage, WrongCommandLinesGiveExitCodeTwo) {
    const std::vector<std::vector<std::string>> wrong = {
        {},
        {"nonsense"},
        {"segment"},
        {"segment", "a.ply", "b.ply"},
        {"segment", "a.ply", "--profile", "best"},
        {"segment", "a.ply", "--noise", "-1"},
        {"segment", "a.ply", "--noise", "5"},  // meant in percent
        {"evaluate", "x", "--noise", "0.5"},
        {"sample", "x", "--noise", "1"},
        {"segment", "a.ply", "--points", "many"},
        {"segment", "a.ply", "--points", "3"},
        {"segment", "a.ply", "--deep-angle", "90"},
        {"segment", "a.ply", "--segments", "33"},
        {"segment", "a.ply", "--interior", "guess"},
        {"segment", "a.ply", "--merge-contrast", "0.5"},
        {"segment", "a.ply", "--min-segment-share", "1.5"},
        {"segment", "a.ply", "--outlier-ratio", "1"},
        {"segment", "a.ply", "--smoothing-reach", "21"},
        {"segment", "a.ply", "--thinning", "-1"},
        {"segment", "a.ply", "--max-segments", "-1"},
        {"segment", "a.ply", "--no-such-flag"},
        {"sample"},
        {"sample", "x", "--count", "0"},
        {"sample", "x", "--families", "unicorn"},
        {"evaluate"},
        {"evaluate", "x", "--match", "colour"},
        {"add"},
        {"add", "x", "--insert-only", "--update-only"},
        {"add", "x", "--key", ""},
        {"query", "--key", ""},
        {"align", "x", "--key", ""},
        {"report", "--key", "", "-o", "x.html"},
        {"query"},
        {"query", "a.ply", "--key", "b"},
        {"collection"},
        {"collection", "create"},
        {"admin"},
        {"admin", "backup"},
        {"delete"},
        {"health", "--timeout", "0"},
    };
    for (const auto& arguments : wrong) {
        std::string line;
        for (const std::string& argument : arguments) line += argument + " ";
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, 2) << line << run.err;
        EXPECT_EQ(run.out, "") << line;
        EXPECT_EQ(run.err.rfind("shapedb: ", 0), 0u) << line << run.err;
        EXPECT_EQ(run.err.find('\n'), run.err.size() - 1) << "one line: " << run.err;
    }
}

TEST_F(Usage, QueryWithoutAShapeSaysWhatItNeeds) {
    EXPECT_NE(runCommand({"query"}).err.find("give a scan file, or --key with a stored shape"),
              std::string::npos);
    EXPECT_NE(runCommand({"query", "a.ply", "--key", "b"}).err.find("not both"), std::string::npos);
}

TEST_F(Usage, WrongValuesAreToldInPlainWords) {
    const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
        {{"query", "a.ply", "-k", "abc"}, "--k: 'abc' is not a whole number of 0 or more"},
        {{"query", "a.ply", "-k", "1.5"}, "--k: '1.5' is not a whole number of 0 or more"},
        {{"query", "a.ply", "--threshold", "half"}, "--threshold: 'half' is not a number"},
        {{"query", "a.ply", "--viewpoint", "1,a,3"}, "--viewpoint: '1,a,3' is not a number"},
        {{"query", "a.ply", "--viewpoint", "1,2"}, "--viewpoint needs 3 values, not 2"},
        {{"query", "a.ply", "-k"}, "--k needs a value"},
        {{"query", "a.ply", "--candidates", "abc"}, "--candidates: 'abc' must be a number, 1 to 10000"},
        {{"list", "--state", "redy"},
         "--state: 'redy' is none of pending, ready, failed: did you mean 'ready'?"},
        {{"completion", "tcsh"}, "SHELL: 'tcsh' is none of bash, zsh, fish"},
        {{"health", "extra"}, "unexpected argument 'extra'"},
        {{"admin"}, "give a command (see 'shapedb admin --help')"},
        {{}, "give a command (see 'shapedb --help')"},
    };
    for (const auto& [arguments, told] : wrong) {
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, 2) << run.err;
        EXPECT_EQ(run.err.rfind("shapedb: " + told, 0), 0u) << run.err;
    }
}

TEST_F(Usage, AKeyInThePlaceOfAFileIsAdvised) {
    const CommandRun run = runCommand({"align", writePoints("a.xyz", dumbbellPoints()), "mug/mug_01"});
    EXPECT_EQ(run.exitCode, 3);
    EXPECT_NE(
        run.err.find("mug/mug_01: cannot be read: No such file or directory; a stored shape is named with "
                     "--key\n"),
        std::string::npos)
        << run.err;
}

TEST_F(Usage, ErrorIsADocumentWithJson) {
    const CommandRun run = runCommand({"segment", "--json", "--no-such-flag"});
    EXPECT_EQ(run.exitCode, 2);
    const auto document = run.json();
    EXPECT_EQ(document["error"]["name"], "invalid_argument");
    EXPECT_NE(document["error"]["message"].get<std::string>().find("segment --help"), std::string::npos);
}

TEST_F(Usage, HelpAndVersionGoToStandardOutput) {
    const std::vector<std::vector<std::string>> asked = {{"--help"},
                                                         {"segment", "--help"},
                                                         {"admin", "rebuild", "-h"},
                                                         {"collection", "--help"},
                                                         {"--version"}};
    for (const auto& arguments : asked) {
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, 0) << run.err;
        EXPECT_NE(run.out, "");
        EXPECT_EQ(run.err, "");
    }
    EXPECT_EQ(runCommand({"--version"}).out.rfind("shapedb ", 0), 0u);
    const std::string help = runCommand({"segment", "--help"}).out;
    for (const char* flag : {"--deep-angle", "--merge-contrast", "--outlier-ratio", "--interior"}) {
        EXPECT_NE(help.find(flag), std::string::npos) << flag;
    }
}

TEST_F(Usage, JsonFlagWorksBeforeAndAfterTheCommand) {
    EXPECT_TRUE(runCommand({"--json", "sample", "--list"}).json().contains("families"));
    EXPECT_TRUE(runCommand({"sample", "--list", "--json"}).json().contains("families"));
}

TEST_F(Usage, UnwritableResultIsAFailure) {
    const std::string file = writePoints("a.xyz", dumbbellPoints());
    const std::string line =
        std::string(SHAPEDB_PATH) + " segment " + file + " --json > /dev/full 2> " + path("err");
    const int status = std::system(line.c_str());
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 3);
}

// The exit code, with a file as standard input.
int runWithInput(const std::string& file, const std::string& arguments, const std::string& output) {
    const std::string line =
        std::string(SHAPEDB_PATH) + " " + arguments + " < " + file + " > " + output + " 2>&1";
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(Usage, CommandsReadStandardInput) {
    const std::string file = writePoints("a.xyz", dumbbellPoints());
    const std::string out = path("out");
    const auto contains = [&](const std::string& text) {
        std::ifstream stream(out);
        const std::string printed{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
        return printed.find(text) != std::string::npos ? ::testing::AssertionSuccess()
                                                       : ::testing::AssertionFailure() << printed;
    };
    EXPECT_EQ(runWithInput(file, "segment - --format xyz", out), 0);
    EXPECT_TRUE(contains("standard input: XYZ text, "));
    EXPECT_EQ(runWithInput(file, "compare --files - " + file + " --format .xyz --json", out), 0);
    EXPECT_TRUE(contains("\"score\": 1.0"));
    EXPECT_EQ(runWithInput(file, "align " + file + " - --format XYZ", out), 0);
    EXPECT_TRUE(contains("standard input is turned"));
    EXPECT_EQ(runWithInput(file, "segment -", out), 2);
    EXPECT_TRUE(contains("--format"));
    EXPECT_EQ(runWithInput(file, "compare --files - - --format xyz", out), 2);
    EXPECT_TRUE(contains("only one of the two"));
    EXPECT_EQ(runWithInput(file, "align - - --format xyz", out), 2);
    EXPECT_EQ(runWithInput(file, "add - --format xyz", out), 2);
    EXPECT_TRUE(contains("needs --key"));
    EXPECT_EQ(runWithInput(file, "add - --format xyz --key a --each", out), 2);
    EXPECT_TRUE(contains("--each"));
    EXPECT_EQ(runWithInput("/dev/null", "segment - --format xyz", out), 3);
    EXPECT_TRUE(contains("standard input: the file is empty"));
}

TEST_F(Usage, InterruptHasItsOwnExitCode) {
    // Enough work to be interrupted in the middle.
    for (int i = 0; i < 20; ++i) {
        writePoints("set/a/" + std::to_string(i) + ".xyz", ellipsoidPoints(1.0, 0.8, 0.6 + 0.01 * i, 20000));
    }
    const int process = startCommand({"evaluate", path("set"), "--threads", "1"});
    ::usleep(400'000);
    ASSERT_EQ(::kill(process, SIGINT), 0);
    int status = 0;
    ::waitpid(process, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
    EXPECT_EQ(WEXITSTATUS(status), 130);
}

TEST_F(Usage, TimeoutEndsOfflineWork) {
    for (int i = 0; i < 20; ++i) {
        writePoints("set/a/" + std::to_string(i) + ".xyz", ellipsoidPoints(1.0, 0.8, 0.6 + 0.01 * i, 20000));
    }
    const CommandRun run =
        runCommand({"evaluate", path("set"), "--threads", "1", "--timeout", "0.3", "--json"});
    EXPECT_EQ(run.exitCode, 5);
    EXPECT_EQ(run.json()["error"]["name"], "deadline_exceeded");
}

TEST_F(Usage, UnreachableServerGivesExitCodeFiveAndItsAddress) {
    const std::string file = writePoints("a.xyz", dumbbellPoints());
    const std::vector<std::vector<std::string>> online = {{"health"},
                                                          {"list"},
                                                          {"count"},
                                                          {"get", "x"},
                                                          {"query", file},
                                                          {"query", "--key", "x"},
                                                          {"compare", "a", "b"},
                                                          {"collection", "list"},
                                                          {"admin", "stats"},
                                                          {"admin", "backup", path("b")}};
    for (auto arguments : online) {
        // Nobody listens on port 1.
        arguments.insert(arguments.end(), {"--server", "127.0.0.1:1", "--json", "--timeout", "0.2"});
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, 5) << arguments[0] << run.err;
        EXPECT_EQ(run.json()["error"]["name"], "unavailable") << arguments[0];
        EXPECT_NE(run.err.find("127.0.0.1:1"), std::string::npos) << run.err;
    }
    EXPECT_NE(runCommand({"health"}, {{"SHAPEDB_SERVER", "127.0.0.1:1"}}).err.find("127.0.0.1:1"),
              std::string::npos)
        << "the environment names the server too";
}

}  // namespace
}  // namespace shapedb::cli
