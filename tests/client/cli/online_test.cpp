// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that need a server, against a real shapedbd.
#include <filesystem>
#include <fstream>

#include "client/cli/console.h"
#include "client/io/scan_reader.h"
#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "tests/client/cli/online_fixture.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ServerProcess;
using testing::TemporaryDirectory;

TEST_F(Online, HealthIsServing) {
    EXPECT_EQ(onlineJson({"health"})["status"], "SERVING");
    EXPECT_EQ(onlineJson({"health", "--service", "shapedb.v1.SearchService"})["status"], "SERVING");
    const json unknown = onlineJson({"health", "--service", "no.such.Service"}, 4);
    EXPECT_EQ(unknown["error"]["name"], "not_found");
}

TEST_F(Online, AddStoresEveryFileOnce) {
    fill("add");
    const json again = onlineJson(
        {"add", scans(), "--base", scans(), "--collection", "add", "--label-from-folder", "--wait"});
    EXPECT_EQ(again["outcomes"], json({{"unchanged", 6}}));
    for (const json& shape : again["added"]) {
        EXPECT_EQ(shape["state"], "ready");
        EXPECT_EQ(shape["metadata"]["label"].get<std::string>() + "/",
                  shape["key"].get<std::string>().substr(
                      0, shape["metadata"]["label"].get<std::string>().size() + 1));
    }
    EXPECT_EQ(onlineJson({"count", "--collection", "add"})["count"], 6);
    EXPECT_EQ(onlineJson({"count", "--collection", "add", "--filter", "label=mug"})["count"], 2);

    const std::string mug = scans() + "/mug/mug_01.ply";
    EXPECT_EQ(onlineJson({"add", mug, "--collection", "add", "--key", "mug/mug_01", "--meta", "label=mug",
                          "--meta", "colour=blue"})["outcomes"],
              json({{"metadata changed", 1}}));
    EXPECT_EQ(onlineJson({"get", "mug/mug_01", "--collection", "add"})["metadata"],
              json({{"label", "mug"}, {"colour", "blue"}}));
    EXPECT_EQ(onlineJson({"add", mug, "--collection", "add", "--key", "fish/fish_01", "--insert-only"},
                         4)["failed"][0]["error"]["name"],
              "already_exists");
    EXPECT_EQ(onlineJson({"add", mug, "--collection", "add", "--key", "new", "--update-only"},
                         4)["failed"][0]["error"]["name"],
              "not_found");
}

TEST_F(Online, AddContinuesAfterABadFile) {
    onlineJson({"collection", "create", "mixed"});
    writePoints("in/good.xyz", dumbbellPoints(2000));
    writePoints("in/flat.xyz", ellipsoidPoints(1.0, 1.0, 0.0, 100));
    write("in/broken.ply", "ply\nformat ascii 1.0\nelement vertex 10\n");
    const CommandRun run =
        online({"add", path("in"), "--base", path("in"), "--collection", "mixed", "--wait", "--json"});
    EXPECT_EQ(run.exitCode, 1);
    const json document = run.json();
    ASSERT_EQ(document["added"].size(), 1u);
    EXPECT_EQ(document["added"][0]["key"], "good");
    EXPECT_EQ(document["failed"].size(), 2u);
    EXPECT_NE(run.err.find("flat.xyz"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("broken.ply"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("2 of 3 files failed"), std::string::npos) << run.err;
}

TEST_F(Online, AddTellsOfListsThatMayHaveBeenFaces) {
    onlineJson({"collection", "create", "groups"});
    const std::string file =
        write("groups.ply",
              "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
              "property float z\nelement groups 1\nproperty list uchar int members\n"
              "end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n2 0 1\n");
    const CommandRun run = online({"add", file, "--key", "a", "--collection", "groups"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.err.find("groups.ply: passed over: list members of element groups"), std::string::npos)
        << run.err;
}

TEST_F(Online, AddTellsFilesOfOneNameApart) {
    onlineJson({"collection", "create", "endings"});
    writePoints("in/a.xyz", dumbbellPoints(500));
    writePoints("in/a.asc", dumbbellPoints(600));
    writePoints("in/b.xyz", dumbbellPoints(500));
    write("in/b.txt", "a note about b\n");
    const auto keysOf = [&](const std::vector<std::string>& words) {
        std::vector<std::string> arguments = {"add", "--base", path("in"), "--collection", "endings"};
        arguments.insert(arguments.end(), words.begin(), words.end());
        std::vector<std::string> keys;
        const json document = onlineJson(arguments);
        for (const json& one : document["added"]) keys.push_back(one["key"]);
        return keys;
    };
    using Names = std::vector<std::string>;
    EXPECT_EQ(keysOf({path("in")}), (Names{"a.asc", "a.xyz", "b"})) << "a note is no scan";
    EXPECT_EQ(keysOf({path("in/a.xyz")}), Names{"a.xyz"}) << "the same key however it is named";
    EXPECT_EQ(onlineJson({"count", "--collection", "endings"})["count"], 3);
    EXPECT_EQ(keysOf({path("in"), "--keep-ending"}), (Names{"a.asc", "a.xyz", "b.xyz"}))
        << "whatever else is in the folder";
}

TEST_F(Online, UpdateOnlyReplacesNoPoints) {
    onlineJson({"collection", "create", "updates"});
    writePoints("in/a.xyz", dumbbellPoints(500));
    writePoints("in/b.xyz", dumbbellPoints(600));
    const auto add = [&](const std::string& file, std::vector<std::string> flags) {
        std::vector<std::string> words = {"add", path(file), "--collection", "updates", "--key", "k"};
        words.insert(words.end(), flags.begin(), flags.end());
        return words;
    };
    EXPECT_EQ(onlineJson(add("in/a.xyz", {"--update-only"}), 4)["failed"][0]["error"]["name"], "not_found");
    EXPECT_EQ(onlineJson(add("in/a.xyz", {"--update-only", "--replace"}), 4)["failed"][0]["error"]["name"],
              "not_found");
    onlineJson(add("in/a.xyz", {}));
    EXPECT_EQ(onlineJson(add("in/a.xyz", {"--update-only", "--meta", "n=1"}))["outcomes"],
              json({{"metadata changed", 1}}));
    const CommandRun refused = online(add("in/b.xyz", {"--update-only"}));
    EXPECT_EQ(refused.exitCode, 4);
    EXPECT_NE(refused.err.find("--replace replaces them"), std::string::npos) << refused.err;
    EXPECT_EQ(onlineJson(add("in/b.xyz", {"--update-only", "--replace"}))["outcomes"],
              json({{"replaced", 1}}));
}

TEST_F(Online, AddRefusesTwoFilesWithOneKey) {
    writePoints("in/a.xyz", dumbbellPoints(500));
    writePoints("in/a.txt", dumbbellPoints(600));
    writePoints("in/a.txt.ply", dumbbellPoints(600));
    const CommandRun run = online({"add", path("in"), "--json"});
    EXPECT_EQ(run.exitCode, 2);
    EXPECT_NE(run.err.find("would both get the key"), std::string::npos) << run.err;
    const CommandRun twice = online({"add", path("in/a.xyz"), path("in/../in/a.xyz")});
    EXPECT_EQ(twice.exitCode, 2) << "one file, typed in two ways";
    EXPECT_EQ(onlineJson({"add", path("in"), "--key", "x"}, 2)["error"]["name"], "invalid_argument");
    EXPECT_EQ(onlineJson({"add", path("in/a.xyz"), "--meta", "nonsense"}, 2)["error"]["name"],
              "invalid_argument");
}

TEST_F(Online, QueryByKeyAndByScanRankTheSame) {
    fill("query");
    const json byScan =
        onlineJson({"query", scans() + "/mug/mug_01.ply", "--collection", "query", "-k", "6"});
    ASSERT_EQ(byScan["hits"].size(), 6u);
    EXPECT_EQ(byScan["hits"][0]["key"], "mug/mug_01");
    EXPECT_EQ(byScan["hits"][0]["score"], 1.0);
    EXPECT_EQ(byScan["hits"][0]["label"], "mug");
    EXPECT_EQ(byScan["candidates"], 6);
    EXPECT_TRUE(byScan["hits"][0].contains("explanation"));

    const json byKey =
        onlineJson({"query", "--key", "mug/mug_01", "--include-self", "--collection", "query", "-k", "6"});
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(byKey["hits"][i]["key"], byScan["hits"][i]["key"]);
        EXPECT_EQ(byKey["hits"][i]["score"], byScan["hits"][i]["score"]);
        EXPECT_EQ(byKey["hits"][i]["rank"], i + 1);
    }
    const json others = onlineJson({"query", "--key", "mug/mug_01", "--collection", "query", "-k", "6"});
    EXPECT_EQ(others["hits"].size(), 5u) << "itself left out";

    const json filtered = onlineJson({"query", "--key", "mug/mug_01", "--collection", "query", "--filter",
                                      "label=fish", "--no-explanation"});
    ASSERT_EQ(filtered["hits"].size(), 2u);
    EXPECT_EQ(filtered["hits"][0]["label"], "fish");
    EXPECT_FALSE(filtered["hits"][0].contains("explanation"));
    const double second = others["hits"][1]["score"];
    EXPECT_EQ(onlineJson({"query", "--key", "mug/mug_01", "--collection", "query", "--threshold",
                          std::to_string(second + 1e-5)})["hits"]
                  .size(),
              1u);
}

TEST_F(Online, QueryTextRanksAndExplains) {
    fill("why");
    const CommandRun run = online({"query", "--key", "human/human_01", "--collection", "why"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    for (const char* word : {"rank", "score", "human/human_02", "Why ", "of the match", "turned by"}) {
        EXPECT_NE(run.out.find(word), std::string::npos) << word << "\n" << run.out;
    }
    const CommandRun every = online({"query", "--key", "human/human_01", "--collection", "why", "--explain"});
    EXPECT_NE(every.out.find("Why fish/fish_01"), std::string::npos) << every.out;
}

TEST_F(Online, AlignAgreesForStoredShapesAndFiles) {
    fill("align");
    const std::string query = scans() + "/mug/mug_01.ply";
    const json stored = onlineJson({"align", query, "--key", "mug/mug_02", "--collection", "align"});
    const json files = onlineJson({"align", query, scans() + "/mug/mug_02.ply"});
    for (const char* name : {"score", "residual", "explained_query", "explained_other", "scale"}) {
        EXPECT_NEAR(stored[name].get<double>(), files[name].get<double>(), 0.02) << name;
    }
    EXPECT_EQ(stored["matrix"].size(), 16u);
    EXPECT_EQ(stored["matrix"][15], 1.0);
    EXPECT_TRUE(stored["alternatives"].is_array());
    const json same =
        onlineJson({"align", query, "--key", "mug/mug_01", "--collection", "align", "--keep-scale"});
    EXPECT_GT(same["score"], 0.97);
    EXPECT_EQ(same["scale"], 1.0);
    EXPECT_EQ(online({"align", query, "--key", "none", "--collection", "align"}).exitCode, kWrongState);
    EXPECT_EQ(online({"align", query}).exitCode, kUsage);
    EXPECT_EQ(online({"align", query, query, "--key", "mug/mug_01"}).exitCode, kUsage);
}

TEST_F(Online, QueryReportsServerErrors) {
    fill("refuse");
    const std::vector<std::string> base = {"query", "--key", "mug/mug_01", "--collection", "refuse"};
    const auto with = [&](const std::vector<std::string>& more, int exitCode) {
        auto arguments = base;
        arguments.insert(arguments.end(), more.begin(), more.end());
        return onlineJson(arguments, exitCode)["error"]["name"];
    };
    EXPECT_EQ(with({"-k", "0"}, 2), "invalid_argument");
    EXPECT_EQ(with({"-k", "51"}, 2), "invalid_argument");
    EXPECT_EQ(with({"--threshold", "1.5"}, 2), "invalid_argument");
    EXPECT_EQ(with({"--filter", "=="}, 2), "malformed_filter");
    EXPECT_EQ(onlineJson({"query", "--key", "nobody", "--collection", "refuse"}, 4)["error"]["name"],
              "not_found");
    EXPECT_EQ(onlineJson({"query", "--key", "x", "--collection", "nowhere"}, 4)["error"]["name"],
              "not_found");
    const std::string flat = writePoints("flat.xyz", ellipsoidPoints(1.0, 1.0, 0.0, 100));
    EXPECT_EQ(onlineJson({"query", flat, "--collection", "refuse"}, 3)["error"]["name"], "coplanar");
}

TEST_F(Online, CompareAgreesForStoredShapesAndFiles) {
    fill("compare");
    const json stored = onlineJson({"compare", "mug/mug_01", "mug/mug_02", "--collection", "compare"});
    const json files = onlineJson({"compare", "--files", scans() + "/mug/mug_01.ply",
                                   scans() + "/mug/mug_02.ply", "--profile", "paper"});
    EXPECT_EQ(stored["score"], files["score"]);
    EXPECT_EQ(stored["explanation"]["matches"], files["explanation"]["matches"]);
    EXPECT_EQ(stored["query"]["points"], files["query"]["points"]);
    EXPECT_EQ(onlineJson({"compare", "a", "b", "--profile", "paper"}, 2)["error"]["name"],
              "invalid_argument");
}

TEST_F(Online, FilesInThePlaceOfKeysAndKeysInThatOfFilesAreAdvised) {
    const std::string file = scans() + "/mug/mug_01.ply";
    const std::string notStored = onlineJson({"compare", file, file}, 4)["error"]["message"];
    EXPECT_NE(notStored.find("; files are compared with --files"), std::string::npos) << notStored;
    const std::string neither = onlineJson({"compare", file, "nosuch"}, 4)["error"]["message"];
    EXPECT_EQ(neither.find("--files"), std::string::npos) << neither;
    const std::string noFile = onlineJson({"query", "mug/mug_01"}, 3)["error"]["message"];
    EXPECT_NE(noFile.find("No such file or directory; a stored shape is named with --key"), std::string::npos)
        << noFile;
}

TEST_F(Online, ListPagesAndFiltersByState) {
    fill("list");
    const json all = onlineJson({"list", "--collection", "list"});
    ASSERT_EQ(all["shapes"].size(), 6u);
    EXPECT_EQ(all["next_cursor"], "");
    const json first = onlineJson({"list", "--collection", "list", "--limit", "4"});
    ASSERT_EQ(first["shapes"].size(), 4u);
    const json rest = onlineJson({"list", "--collection", "list", "--cursor", first["next_cursor"]});
    ASSERT_EQ(rest["shapes"].size(), 2u);
    EXPECT_EQ(rest["shapes"][0]["key"], all["shapes"][4]["key"]);
    EXPECT_EQ(onlineJson({"list", "--collection", "list", "--state", "failed"})["shapes"].size(), 0u);
    EXPECT_EQ(onlineJson({"list", "--collection", "list", "--cursor", "rubbish"}, 2)["error"]["name"],
              "malformed_cursor");
}

TEST_F(Online, GetWritesTheSegmentedPoints) {
    fill("get");
    const json shape = onlineJson({"get", "fish/fish_01", "--collection", "get", "--out", path("fish.ply")});
    EXPECT_EQ(shape["state"], "ready");
    EXPECT_EQ(shape["points"], 2000);
    const auto scan = readScan(path("fish.ply"));
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_EQ(scan->points.size(), 2000u);

    const json offline =
        runCommand({"segment", scans() + "/fish/fish_01.ply", "--profile", "paper", "--json"}).json();
    const json signature = onlineJson({"signature", "fish/fish_01", "--collection", "get"});
    EXPECT_EQ(signature["points"], offline["signature"]) << "the server computes what the command computes";
    EXPECT_EQ(onlineJson({"get", "nobody", "--collection", "get"}, 4)["error"]["name"], "not_found");
}

TEST_F(Online, WatchEndsWhenReady) {
    onlineJson({"collection", "create", "watch"});
    writePoints("flat.xyz", ellipsoidPoints(1.0, 1.0, 0.0, 100));
    writePoints("bell.xyz", dumbbellPoints(2000));
    onlineJson({"add", path("bell.xyz"), "--base", folder(), "--collection", "watch"});
    EXPECT_EQ(onlineJson({"watch", "bell", "--collection", "watch"})["state"], "ready");
    EXPECT_EQ(onlineJson({"watch", "nobody", "--collection", "watch"}, 4)["error"]["name"], "not_found");
}

TEST_F(Online, DeleteRemovesShapes) {
    fill("delete");
    EXPECT_EQ(onlineJson({"delete", "mug/mug_01", "--collection", "delete", "--expected-version", "7"},
                         4)["error"]["name"],
              "version_conflict");
    const json document =
        onlineJson({"delete", "mug/mug_01", "nobody", "mug/mug_02", "--collection", "delete"}, 1);
    EXPECT_EQ(document["deleted"].size(), 2u);
    EXPECT_EQ(document["failed"][0]["key"], "nobody");
    EXPECT_EQ(onlineJson({"count", "--collection", "delete"})["count"], 4);
    EXPECT_EQ(onlineJson({"delete", "mug/mug_01", "--collection", "delete"}, 4)["error"]["name"],
              "not_found");
}

TEST_F(Online, CollectionsAreCreatedListedAndDeleted) {
    const json made = onlineJson({"collection", "create", "mine", "--description", "for the test",
                                  "--profile", "paper", "--segments", "5", "--deep-angle", "22"});
    EXPECT_EQ(made["parameters"]["max_points"], 5);
    EXPECT_EQ(made["parameters"]["deep_angle_degrees"], 22.0);
    EXPECT_EQ(made["parameters"]["profile"], "paper");
    EXPECT_EQ(onlineJson({"collection", "get", "mine"}), made);
    EXPECT_EQ(onlineJson({"collection", "create", "mine"}, 4)["error"]["name"], "already_exists");
    bool listed = false;
    const json list = onlineJson({"collection", "list"});
    for (const json& one : list["collections"]) listed = listed || one == made;
    EXPECT_TRUE(listed);

    writePoints("bell.xyz", dumbbellPoints(1000));
    onlineJson({"add", path("bell.xyz"), "--collection", "mine"});
    EXPECT_EQ(online({"collection", "delete", "mine"}).exitCode, 4);
    EXPECT_EQ(onlineJson({"collection", "delete", "mine", "--force"})["deleted"], "mine");
    EXPECT_EQ(onlineJson({"collection", "get", "mine"}, 4)["error"]["name"], "not_found");
}

TEST_F(Online, RebuildWithNewParametersChangesTheSignatures) {
    fill("rebuild");
    const json done = onlineJson({"admin", "rebuild", "--collection", "rebuild", "--segments", "2"});
    ASSERT_EQ(done["rebuilt"].size(), 1u);
    EXPECT_EQ(done["rebuilt"][0]["done"], 6);
    EXPECT_EQ(done["rebuilt"][0]["finished"], true);
    EXPECT_EQ(onlineJson({"signature", "mug/mug_01", "--collection", "rebuild"})["points"].size(), 2u);
    EXPECT_EQ(onlineJson({"admin", "rebuild", "--collection", "rebuild", "--cancel"}, 4)["error"]["name"],
              "not_found");
    EXPECT_EQ(online({"admin", "rebuild", "--collection", "rebuild", "--cache-only"}).exitCode, 0);
}

TEST_F(Online, RestoreBringsBackABackup) {
    // A server of its own: restoring replaces everything.
    const TemporaryDirectory directory;
    const ServerProcess own(directory.path() + "/data");
    const std::vector<std::string> to = {"--server", own.address(), "--json"};
    const auto ask = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), to.begin(), to.end());
        return runCommand(arguments);
    };
    EXPECT_EQ(ask({"add", scans() + "/mug", "--base", scans() + "/mug", "--wait"}).exitCode, 0);
    const json backup = ask({"admin", "backup", path("copy.db")}).json();
    EXPECT_EQ(backup["bytes"], fs::file_size(path("copy.db")));
    EXPECT_FALSE(fs::exists(path("copy.db.part")));
    EXPECT_EQ(ask({"delete", "mug_01", "mug_02"}).exitCode, 0);
    EXPECT_EQ(ask({"count"}).json()["count"], 0);
    const json restored = ask({"admin", "restore", path("copy.db")}).json();
    EXPECT_EQ(restored["shapes"], 2);
    EXPECT_EQ(ask({"count"}).json()["count"], 2);
    EXPECT_EQ(ask({"query", "--key", "mug_01"}).json()["hits"].size(), 1u);

    write("rubbish.db", "this is no database");
    EXPECT_NE(ask({"admin", "restore", path("rubbish.db")}).exitCode, 0);
    EXPECT_EQ(ask({"count"}).json()["count"], 2) << "a bad backup changes nothing";
    EXPECT_EQ(ask({"admin", "restore", path("missing.db")}).exitCode, 3);
    EXPECT_EQ(ask({"admin", "backup", path("no/such/folder/copy.db")}).exitCode, 3);
}

TEST_F(Online, OneCollectionIsExportedAndImported) {
    fill("moving");
    const json exported = onlineJson({"collection", "export", "moving", path("moving.db")});
    EXPECT_EQ(exported["collection"], "moving");
    EXPECT_EQ(exported["bytes"], fs::file_size(path("moving.db")));
    EXPECT_EQ(exported["sha256"].get<std::string>().size(), 64u);
    EXPECT_FALSE(fs::exists(path("moving.db.part")));
    EXPECT_EQ(onlineJson({"collection", "import", path("moving.db")}, 4)["error"]["name"], "already_exists");
    const json imported = onlineJson({"collection", "import", path("moving.db"), "--name", "moved"});
    EXPECT_EQ(imported["collection"], "moved");
    EXPECT_EQ(imported["shapes"], 6);
    EXPECT_EQ(imported["shapes_pending"], 0);
    json hits[2];
    for (int i = 0; i < 2; ++i) {
        hits[i] =
            onlineJson({"query", "--key", "mug/mug_01", "--collection", i == 0 ? "moving" : "moved"})["hits"];
    }
    ASSERT_EQ(hits[0].size(), hits[1].size());
    for (std::size_t i = 0; i < hits[0].size(); ++i) {
        EXPECT_EQ(hits[0][i]["key"], hits[1][i]["key"]);
        EXPECT_EQ(hits[0][i]["score"], hits[1][i]["score"]);
    }
    EXPECT_EQ(online({"collection", "delete", "moving", "--force"}).exitCode, 0);
    const auto again = online({"collection", "import", path("moving.db")});
    EXPECT_EQ(again.exitCode, 0);
    EXPECT_NE(again.out.find("moving: 6 shapes imported from "), std::string::npos) << again.out;

    write("rubbish.db", "this is no database");
    EXPECT_EQ(onlineJson({"collection", "import", path("rubbish.db"), "--name", "x"}, 3)["error"]["name"],
              "malformed_file");
    EXPECT_EQ(online({"collection", "import", path("missing.db")}).exitCode, 3);
    EXPECT_EQ(online({"collection", "export", "nothing", path("nothing.db")}).exitCode, 4);
    EXPECT_FALSE(fs::exists(path("nothing.db")));
    EXPECT_EQ(online({"collection", "export", "moving", path("no/such/folder/x.db")}).exitCode, 3);
}

TEST_F(Online, CheckStatsAndInfoReport) {
    fill("care");
    EXPECT_EQ(onlineJson({"admin", "check"})["sound"], true);
    EXPECT_EQ(onlineJson({"admin", "check", "--acknowledge"})["sound"], true);
    const json stats = onlineJson({"admin", "stats"});
    EXPECT_GE(stats["shapes_ready"].get<int>(), 6);
    EXPECT_GT(stats["database_bytes"].get<std::uint64_t>(), 0u);
    const json info = onlineJson({"admin", "info"});
    EXPECT_EQ(info["limits"]["max_k"], 50);
    EXPECT_EQ(info["server"], server()->address());
    for (const char* command : {"check", "stats", "info"}) {
        const CommandRun run = online({"admin", command});
        EXPECT_EQ(run.exitCode, 0);
        EXPECT_NE(run.out, "");
    }
}

}  // namespace
}  // namespace shapedb::cli
