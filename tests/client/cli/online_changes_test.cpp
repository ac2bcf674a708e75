// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that change many shapes, list them in other orders, count values and group hits, against a
// real shapedbd.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "client/cli/console.h"
#include "client/io/scan_reader.h"
#include "tests/client/cli/online_fixture.h"

namespace shapedb::cli {
namespace {

using nlohmann::json;

/// A collection with six samples for each test.
class OnlineChanges : public Online {
  protected:
    OnlineChanges() {
        collection = ::testing::UnitTest::GetInstance()->current_test_info()->name();
        onlineJson({"collection", "create", collection, "--profile", "paper"});
        const json added = in({"add", scans(), "--base", scans(), "--label-from-folder", "--wait"});
        EXPECT_EQ(added["added"].size(), 6u);
    }

    CommandRun textIn(std::vector<std::string> arguments) const {
        arguments.insert(arguments.end(), {"--collection", collection});
        return online(arguments);
    }
    json in(std::vector<std::string> arguments, int exitCode = 0) const {
        arguments.insert(arguments.end(), {"--collection", collection});
        return onlineJson(arguments, exitCode);
    }
    std::vector<std::string> listed(std::vector<std::string> flags) const {
        flags.insert(flags.begin(), "list");
        std::vector<std::string> keys;
        const json document = in(flags);
        for (const json& shape : document["shapes"]) keys.push_back(shape["key"]);
        return keys;
    }

    std::string collection;
};

using Keys = std::vector<std::string>;

TEST_F(OnlineChanges, StandardInputIsStoredAndSearchedWith) {
    const std::string file = scans() + "/mug/mug_01.ply";
    const auto withInput = [&](const std::string& arguments) {
        return std::system((std::string(SHAPEDB_PATH) + " " + arguments + " --format ply --collection " +
                            collection + " --server " + server()->address() + " < " + file + " > " +
                            path("out"))
                               .c_str());
    };
    EXPECT_EQ(withInput("add - --key piped --wait"), 0);
    EXPECT_EQ(listed({"--prefix", "piped"}), Keys{"piped"});
    EXPECT_EQ(withInput("query - --json"), 0);
    std::ifstream found(path("out"));
    EXPECT_EQ(json::parse(found)["hits"][0]["score"], 1.0);
}

TEST_F(OnlineChanges, MetadataIsMergedRemovedAndReplaced) {
    EXPECT_EQ(in({"metadata", "--filter", "label=mug", "--set", "colour=blue", "--set", "size=3"})["changed"],
              2);
    EXPECT_EQ(in({"get", "mug/mug_01"})["metadata"],
              json({{"label", "mug"}, {"colour", "blue"}, {"size", "3"}}));
    EXPECT_EQ(in({"count", "--filter", "colour=blue"})["count"], 2);
    EXPECT_EQ(in({"query", "--key", "fish/fish_01", "--filter", "colour=blue"})["hits"].size(), 2u)
        << "searches see it";
    const json again = in({"metadata", "--filter", "label=mug", "--set", "size=3"});
    EXPECT_EQ(again["changed"], 0);
    EXPECT_EQ(again["unchanged"], 2);
    const json some = in({"metadata", "mug/mug_01", "nobody", "--remove", "colour"}, kSomeFailed);
    EXPECT_EQ(some["changed"], 1);
    EXPECT_EQ(some["failed"][0]["key"], "nobody");
    EXPECT_EQ(some["shapes"][0]["metadata"], json({{"label", "mug"}, {"size", "3"}}));
    EXPECT_EQ(in({"metadata", "mug/mug_01", "--replace-all", "--set", "a=b=c"})["changed"], 1);
    EXPECT_EQ(in({"get", "mug/mug_01"})["metadata"], json({{"a", "b=c"}}));
    EXPECT_EQ(in({"metadata", "mug/mug_01", "--expected-version", "1", "--set", "x=y"}, 4)["error"]["name"],
              "version_conflict");
    EXPECT_EQ(in({"metadata", "--filter", "", "--replace-all"}, 4)["error"]["name"], "rejected");
    EXPECT_EQ(in({"metadata", "--filter", "", "--replace-all", "--yes"})["changed"], 6);
    EXPECT_EQ(in({"get", "fish/fish_01"})["state"], "ready");
    EXPECT_EQ(in({"metadata", "mug/mug_01"}, 2)["error"]["name"], "invalid_argument") << "nothing to change";
    EXPECT_EQ(in({"metadata", "--set", "a=b"}, 2)["error"]["name"], "invalid_argument") << "of which shape?";
    EXPECT_EQ(in({"metadata", "mug/mug_01", "--filter", "", "--set", "a=b"}, 2)["error"]["name"],
              "invalid_argument");
    EXPECT_EQ(in({"metadata", "mug/mug_01", "--set", "ab"}, 2)["error"]["name"], "invalid_argument");
    EXPECT_EQ(in({"metadata", "mug/mug_01", "--set", "a b=c"}, 2)["error"]["name"], "invalid_argument");
}

TEST_F(OnlineChanges, OneFullShapeIsNamed) {
    std::vector<std::string> fill = {"metadata", "mug/mug_01"};
    for (int i = 0; i < 63; ++i) fill.insert(fill.end(), {"--set", "m" + std::to_string(i) + "=v"});
    in(fill);
    const CommandRun done = textIn({"metadata", "--filter", "", "--set", "one=more"});
    EXPECT_EQ(done.exitCode, kSomeFailed);
    EXPECT_NE(done.out.find("5 shapes changed"), std::string::npos) << done.out;
    EXPECT_NE(done.err.find("mug/mug_01: metadata: 65 entries"), std::string::npos) << done.err;
}

TEST_F(OnlineChanges, DeletingByFilterNeedsYes) {
    const CommandRun asked = textIn({"delete", "--filter", "label=mug"});
    EXPECT_EQ(asked.exitCode, kWrongState);
    EXPECT_NE(asked.err.find("2 shapes pass the filter; --yes deletes them"), std::string::npos) << asked.err;
    EXPECT_EQ(in({"count"})["count"], 6);
    EXPECT_EQ(in({"delete", "--filter", "label=mug", "--yes"})["count"], 2);
    EXPECT_EQ(in({"count"})["count"], 4);
    EXPECT_EQ(in({"delete", "--yes"}, 2)["error"]["name"], "invalid_argument") << "no filter is not all";
    EXPECT_EQ(in({"delete", "--filter", "=", "--yes"}, 2)["error"]["name"], "malformed_filter");
    EXPECT_EQ(in({"delete", "--filter", "", "--yes"})["count"], 4);
}

TEST_F(OnlineChanges, RetryQueuesWhatFailed) {
    // A sheet, hardly bent: profile `paper` finds no interior.
    PointCloud open;
    for (int i = 0; i < 40; ++i) {
        for (int j = 0; j < 40; ++j) {
            const double x = 0.05 * i - 1.0 + 0.001 * ((7 * i + 3 * j) % 11);
            const double y = 0.05 * j - 1.0 + 0.001 * ((5 * i + 2 * j) % 13);
            open.push_back({x, y, 0.01 * (x * x + y * y)});
        }
    }
    const std::string file = writePoints("open.xyz", open);
    in({"add", file, "--key", "open", "--wait"}, 3);
    EXPECT_EQ(in({"get", "open"})["state"], "failed");
    EXPECT_EQ(in({"retry"})["queued"], 1);
    EXPECT_EQ(in({"watch", "open"}, 3)["state"], "failed");
    const json some = in({"retry", "open", "mug/mug_01", "nobody"}, kSomeFailed);
    EXPECT_EQ(some["queued"], 1);
    EXPECT_EQ(some["not_failed"], json({"mug/mug_01"}));
    EXPECT_EQ(some["missing"], json({"nobody"}));
    in({"watch", "open"}, 3);
    EXPECT_EQ(in({"retry", "--filter", "label=mug"})["queued"], 0);
    EXPECT_EQ(in({"retry", "nobody"}, kWrongState)["queued"], 0);
}

TEST_F(OnlineChanges, ListsInEveryOrder) {
    EXPECT_EQ(listed({"--order", "key"}), (Keys{"fish/fish_01", "fish/fish_02", "human/human_01",
                                                "human/human_02", "mug/mug_01", "mug/mug_02"}));
    EXPECT_EQ(listed({"--order", "-key", "--limit", "2"}), (Keys{"mug/mug_02", "mug/mug_01"}));
    EXPECT_EQ(listed({"--prefix", "human/"}), (Keys{"human/human_01", "human/human_02"}));
    EXPECT_EQ(in({"count", "--prefix", "human/"})["count"], 2);
    EXPECT_EQ(in({"count", "--prefix", "human/", "--by", "label"}, 2)["error"]["name"], "invalid_argument");
    EXPECT_EQ(listed({"--prefix", "human/", "--order", "-id"}), (Keys{"human/human_02", "human/human_01"}));
    in({"metadata", "human/human_01", "--set", "seen=yes"});
    EXPECT_EQ(listed({"--order", "-updated", "--limit", "1"}), Keys{"human/human_01"});
    EXPECT_EQ(listed({"--order", "updated"}).back(), "human/human_01");
    const json first = in({"list", "--order", "-key", "--limit", "4"});
    EXPECT_EQ(listed({"--order", "-key", "--cursor", first["next_cursor"]}),
              (Keys{"fish/fish_02", "fish/fish_01"}));
    EXPECT_EQ(in({"list", "--order", "key", "--cursor", first["next_cursor"]}, 2)["error"]["name"],
              "malformed_cursor");
    EXPECT_EQ(in({"list", "--order", "size"}, 2)["error"]["name"], "invalid_argument");
}

TEST_F(OnlineChanges, CountsByValue) {
    in({"metadata", "mug/mug_01", "--set", "label=cup"});
    in({"metadata", "mug/mug_02", "--remove", "label"});
    const json counts = in({"count", "--by", "label", "--limit", "2"});
    EXPECT_EQ(counts["values"],
              json({{{"value", "fish"}, {"count", 2}}, {{"value", "human"}, {"count", 2}}}));
    EXPECT_EQ(counts["other_values"], 1);
    EXPECT_EQ(counts["other_count"], 1);
    EXPECT_EQ(counts["without"], 1);
    EXPECT_EQ(in({"count", "--by", "label", "--filter", "label=cup"})["values"].size(), 1u);
    const CommandRun text = textIn({"count", "--by", "label", "--limit", "2"});
    EXPECT_NE(text.out.find("and 1 other value: 1 shape"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("1 shape without label"), std::string::npos) << text.out;
    EXPECT_EQ(in({"count", "--by", "a b"}, 2)["error"]["name"], "invalid_argument");
}

TEST_F(OnlineChanges, GroupsHits) {
    in({"metadata", "mug/mug_02", "--remove", "label"});
    const json grouped =
        in({"query", "--key", "human/human_01", "-k", "3", "--group-by", "label", "--per-group", "2"});
    const json plain = in({"query", "--key", "human/human_01", "-k", "6"});
    ASSERT_EQ(grouped["hits"].size(), 4u) << "one human is the query, one mug has no label";
    std::vector<json> order;
    for (const json& hit : grouped["hits"]) {
        if (order.empty() || order.back() != hit["group"]) order.push_back(hit["group"]);
        bool found = false;
        for (const json& other : plain["hits"]) {
            found = found || (other["key"] == hit["key"] && other["score"] == hit["score"]);
        }
        EXPECT_TRUE(found) << hit["key"];
    }
    EXPECT_EQ(order.size(), 3u) << "each group in one piece";
    EXPECT_EQ(order.front(), "human");
    EXPECT_EQ(grouped["hits"][0]["key"], plain["hits"][0]["key"]);
    EXPECT_FALSE(plain["hits"][0].contains("group"));
    const CommandRun text = textIn({"query", "--key", "human/human_01", "--group-by", "label"});
    EXPECT_NE(text.out.find("(none)"), std::string::npos) << text.out;
    EXPECT_EQ(textIn({"query", "--key", "human/human_01", "--per-group", "2"}).exitCode, kUsage);
}

TEST_F(OnlineChanges, GetWritesThePointsAsTheyWereSent) {
    const std::string file = scans() + "/fish/fish_01.ply";
    in({"get", "fish/fish_01", "--points", "--out", path("fish.ply")});
    const auto sent = readScan(file);
    const auto got = readScan(path("fish.ply"));
    ASSERT_TRUE(sent && got);
    ASSERT_EQ(got->points.size(), sent->points.size());
    for (std::size_t i = 0; i < got->points.size(); ++i) {
        EXPECT_EQ(got->points[i], sent->points[i]) << "in the same order, bit for bit";
    }
    EXPECT_EQ(in({"get", "fish/fish_01", "--points"}, 2)["error"]["name"], "invalid_argument");
    EXPECT_EQ(in({"get", "nobody", "--points", "--out", path("x.ply")}, 4)["error"]["name"], "not_found");

    // Surveyed coordinates come back where they were.
    PointCloud surveyed = dumbbellPoints(1000);
    for (Point3& point : surveyed) point = point + Point3{4.5e6, 5.4e6, 312.5};
    std::string text;
    for (const Point3& p : surveyed) {
        text += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
    }
    const std::string far = write("surveyed.xyz", text);
    in({"add", far, "--key", "surveyed"});
    in({"get", "surveyed", "--points", "--out", path("back.ply")});
    const auto back = readScan(path("back.ply"));
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_EQ(back->points.size(), surveyed.size());
    for (std::size_t i = 0; i < surveyed.size(); ++i) {
        EXPECT_LT(distance(back->points[i], surveyed[i]), 2e-6);
    }
}

TEST_F(OnlineChanges, AddKeepsMetadataAndOtherFilesPoints) {
    const std::string mug = scans() + "/mug/mug_01.ply";
    EXPECT_EQ(in({"add", mug, "--base", scans()})["outcomes"], json({{"unchanged", 1}}))
        << "an upload without metadata leaves them";
    EXPECT_EQ(in({"get", "mug/mug_01"})["metadata"], json({{"label", "mug"}}));
    const CommandRun refused = textIn({"add", scans() + "/fish/fish_01.ply", "--key", "mug/mug_01"});
    EXPECT_EQ(refused.exitCode, kWrongState);
    EXPECT_NE(refused.err.find("--replace replaces them"), std::string::npos) << refused.err;
    EXPECT_EQ(in({"add", mug, "--base", scans(), "--meta", "label=cup"})["outcomes"],
              json({{"metadata changed", 1}}));
    const json replaced =
        in({"add", scans() + "/fish/fish_01.ply", "--key", "mug/mug_01", "--replace", "--wait"});
    EXPECT_EQ(replaced["outcomes"], json({{"replaced", 1}}));
    EXPECT_EQ(in({"get", "mug/mug_01"})["metadata"], json({{"label", "cup"}}));
}

// The same name in two folders, and one file typed in several ways.
TEST_F(OnlineChanges, KeysTellFoldersApart) {
    writePoints("one/part.xyz", dumbbellPoints(300));
    writePoints("two/part.xyz", dumbbellPoints(400));
    const json first = in({"add", path("one/part.xyz"), path("two/part.xyz")});
    ASSERT_EQ(first["added"].size(), 2u);
    EXPECT_NE(first["added"][0]["key"], first["added"][1]["key"]);
    const json again = in({"add", folder() + "/./one/../one", path("two") + "/"});
    EXPECT_EQ(again["outcomes"], json({{"unchanged", 2}}));
    EXPECT_EQ(again["added"][0]["key"], first["added"][0]["key"]);
    EXPECT_EQ(in({"add", path("one"), "--base", path("one")})["added"][0]["key"], "part");
    EXPECT_EQ(in({"add", path("two"), "--base", path("two")}, 4)["failed"][0]["error"]["name"],
              "already_exists");
    EXPECT_EQ(in({"add", path("one"), "--base", path("two")}, 2)["error"]["name"], "invalid_argument");
}

TEST_F(OnlineChanges, CollectionsAreRenamedAndHaveAliases) {
    EXPECT_EQ(onlineJson({"collection", "alias", "live", collection})["collection"], collection);
    EXPECT_EQ(onlineJson({"count", "--collection", "live"})["count"], 6);
    EXPECT_EQ(onlineJson({"query", "--key", "mug/mug_01", "--collection", "live"})["hits"].size(), 5u);
    onlineJson({"collection", "create", "next"});
    EXPECT_EQ(onlineJson({"collection", "alias", "live", "next"})["collection"], "next");
    EXPECT_EQ(onlineJson({"count", "--collection", "live"})["count"], 0);
    EXPECT_EQ(onlineJson({"collection", "get", "next"})["aliases"], json({"live"}));
    EXPECT_EQ(onlineJson({"collection", "rename", "next", "later"})["name"], "later");
    EXPECT_EQ(onlineJson({"count", "--collection", "live"})["count"], 0);
    EXPECT_EQ(onlineJson({"collection", "get", "next"}, 4)["error"]["name"], "not_found");
    EXPECT_EQ(onlineJson({"collection", "delete", "live", "--force"}, 4)["error"]["name"], "not_found");
    EXPECT_EQ(onlineJson({"collection", "alias", collection, "later"}, 4)["error"]["name"], "already_exists");
    EXPECT_EQ(onlineJson({"collection", "unalias", "live"})["deleted"], "live");
    EXPECT_EQ(onlineJson({"count", "--collection", "live"}, 4)["error"]["name"], "not_found");
}

TEST_F(OnlineChanges, ACollectionThatIsNotThereIsOneErrorWithOneExitCode) {
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{"get", "a"},
                                               {"list"},
                                               {"count"},
                                               {"delete", "a"},
                                               {"delete", "a", "b"},
                                               {"delete", "--filter", "a", "--yes"},
                                               {"metadata", "a", "b", "--set", "x=1"},
                                               {"retry", "a", "b"},
                                               {"add", scans()},
                                               {"query", scans()},
                                               {"duplicates"},
                                               {"watch", "a"}}) {
        std::vector<std::string> there = arguments;
        there.insert(there.end(), {"--collection", "nowhere"});
        const CommandRun run = online(there);
        EXPECT_EQ(run.exitCode, kWrongState) << arguments[0] << ": " << run.err;
        EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << arguments[0] << ": " << run.err;
        EXPECT_NE(run.err.find("nowhere"), std::string::npos) << run.err;
    }
    EXPECT_EQ(textIn({"delete", "a", "b"}).exitCode, kSomeFailed) << "of keys each is named";
}

}  // namespace
}  // namespace shapedb::cli
