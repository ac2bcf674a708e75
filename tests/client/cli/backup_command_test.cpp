// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin backup|restore|merge-backups` with increments, as a user types them.
#include <filesystem>
#include <string>
#include <vector>

#include "tests/client/cli/run_command.h"
#include "tests/integration/support/server_process.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ServerProcess;
using testing::TemporaryDirectory;

class BackupCommand : public CommandTest {
  protected:
    BackupCommand() : server_(data_.path()) {
        EXPECT_EQ(online({"collection", "create", "c", "--profile", "paper"}).exitCode, 0);
    }
    CommandRun online(std::vector<std::string> arguments) const {
        arguments.insert(arguments.end(), {"--server", server_.address(), "--timeout", "60"});
        return runCommand(arguments);
    }
    json onlineJson(std::vector<std::string> arguments, int exitCode = 0) const {
        arguments.emplace_back("--json");
        const CommandRun run = online(arguments);
        EXPECT_EQ(run.exitCode, exitCode) << run.err;
        return run.json();
    }
    void add(const std::string& key) const {
        writePoints(key + ".xyz", dumbbellPoints(1'000 + key.size()));
        EXPECT_EQ(online({"add", path(key + ".xyz"), "--key", key, "--collection", "c", "--wait"}).exitCode,
                  0);
    }

    TemporaryDirectory data_;
    ServerProcess server_;
};

TEST_F(BackupCommand, AChainIsMadeRestoredAndMerged) {
    add("a");
    const std::string full = path("full.db");
    onlineJson({"admin", "backup", full});
    add("bb");
    const json first = onlineJson({"admin", "backup", path("1.sdbi"), "--since", full});
    EXPECT_EQ(first["since"], full);
    EXPECT_EQ(first["bytes"], fs::file_size(path("1.sdbi")));
    EXPECT_EQ(first["backup_sha256"].get<std::string>().size(), 64u);
    EXPECT_GT(first["changed_bytes"], 0);
    EXPECT_LE(first["changed_bytes"], first["backup_bytes"]);
    add("ccc");
    const CommandRun second = online({"admin", "backup", path("2.sdbi"), "--since", path("1.sdbi")});
    EXPECT_EQ(second.exitCode, 0) << second.err;
    EXPECT_NE(second.out.find(" changed since " + path("1.sdbi")), std::string::npos) << second.out;

    EXPECT_EQ(online({"delete", "a", "bb", "ccc", "--collection", "c"}).exitCode, 0);
    const json restored = onlineJson({"admin", "restore", full, path("1.sdbi"), path("2.sdbi")});
    EXPECT_EQ(restored["shapes"], 3);
    EXPECT_EQ(restored["increments"], json({path("1.sdbi"), path("2.sdbi")}));

    // Needs no server.
    const CommandRun merged = runCommand({"admin", "merge-backups", full, path("1.sdbi"), "--out",
                                          path("m.db"), "--json", "--server", "127.0.0.1:1"});
    EXPECT_EQ(merged.exitCode, 0) << merged.err;
    EXPECT_EQ(merged.json()["sha256"], first["backup_sha256"]);
    EXPECT_EQ(merged.json()["bytes"], fs::file_size(path("m.db")));
    EXPECT_EQ(onlineJson({"admin", "restore", path("m.db")})["shapes"], 2);
}

TEST_F(BackupCommand, MistakesAreExplained) {
    add("a");
    const std::string full = path("full.db");
    onlineJson({"admin", "backup", full});
    onlineJson({"admin", "backup", path("1.sdbi"), "--since", full});
    add("bb");
    onlineJson({"admin", "backup", path("2.sdbi"), "--since", path("1.sdbi")});
    const auto refused = [&](const std::vector<std::string>& arguments, int exitCode,
                             const std::string& words) {
        const CommandRun run = online(arguments);
        EXPECT_EQ(run.exitCode, exitCode) << run.err;
        EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
    };
    refused({"admin", "backup", path("1.sdbi"), "--since", full}, 4, "an increment replaces no file");
    refused({"admin", "backup", path("3.sdbi"), "--since", ""}, 2, "--since: the name of a file is missing");
    refused({"admin", "backup", path("3.sdbi"), "--since", path("none")}, 3, "none");
    refused({"admin", "backup", path("3.sdbi"), "--since", path("a.xyz")}, 3,
            "neither a backup nor an increment");
    refused({"admin", "restore", full, path("2.sdbi"), path("1.sdbi")}, 2, "it belongs after");
    refused({"admin", "restore", path("1.sdbi")}, 2, "is an increment");
    refused({"admin", "restore", path("a.xyz")}, 3, "the file is no backup of ShapeDB");
    refused({"collection", "import", path("a.xyz")}, 3, "the file is no export of ShapeDB");
    refused({"admin", "merge-backups", full, path("1.sdbi")}, 2, "--out");
    refused({"admin", "merge-backups", full, "--out", path("m.db")}, 2, "INCREMENT");
    refused({"admin", "merge-backups", full, path("1.sdbi"), "--out", full}, 2, "choose another name");
    EXPECT_EQ(onlineJson({"count", "--collection", "c"})["count"], 2) << "nothing was restored";
}

}  // namespace
}  // namespace shapedb::cli
