// SPDX-License-Identifier: GPL-3.0-or-later
// A real shapedbd, and commands that talk to it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_command.h"
#include "tests/integration/support/server_process.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::cli {

/// One server for all tests, one collection per test.
class Online : public CommandTest {
  protected:
    static void SetUpTestSuite() {
        data() = std::make_unique<testing::TemporaryDirectory>();
        server() = std::make_unique<testing::ServerProcess>(data()->path(),
                                                            std::vector<std::string>{"--limits-max-k", "50"});
        scans() = data()->path() + "/scans";
        const CommandRun run = runCommand(
            {"sample", scans(), "--count", "2", "--points", "2000", "--families", "human,mug,fish"});
        ASSERT_EQ(run.exitCode, 0) << run.err;
    }
    static void TearDownTestSuite() {
        server().reset();
        data().reset();
    }

    static std::unique_ptr<testing::TemporaryDirectory>& data() {
        static std::unique_ptr<testing::TemporaryDirectory> directory;
        return directory;
    }
    static std::unique_ptr<testing::ServerProcess>& server() {
        static std::unique_ptr<testing::ServerProcess> process;
        return process;
    }
    static std::string& scans() {
        static std::string folder;
        return folder;
    }

    static CommandRun online(std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), {"--server", server()->address(), "--timeout", "60"});
        return runCommand(arguments);
    }
    static nlohmann::json onlineJson(std::vector<std::string> arguments, int exitCode = 0) {
        arguments.emplace_back("--json");
        const CommandRun run = online(arguments);
        EXPECT_EQ(run.exitCode, exitCode) << arguments[0] << ": " << run.err;
        return run.json();
    }
    /// A collection with the six samples, segmented.
    static void fill(const std::string& collection) {
        onlineJson({"collection", "create", collection, "--profile", "paper"});
        const nlohmann::json added = onlineJson(
            {"add", scans(), "--base", scans(), "--collection", collection, "--label-from-folder", "--wait"});
        ASSERT_EQ(added["added"].size(), 6u);
    }
};

}  // namespace shapedb::cli
