// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb duplicates` against each shape compared with each; a real shapedbd.
#include <algorithm>
#include <cmath>
#include <set>

#include "client/cli/console.h"
#include "client/cli/duplicate_search.h"
#include "tests/client/cli/online_fixture.h"

namespace shapedb::cli {
namespace {

using nlohmann::json;

using OnlineDuplicates = Online;
using KeyPair = std::pair<std::string, std::string>;

std::set<KeyPair> pairsOf(const json& document) {
    std::set<KeyPair> pairs;
    for (const json& pair : document["pairs"]) {
        const std::string a = pair["a"];
        const std::string b = pair["b"];
        EXPECT_TRUE(pairs.insert(std::minmax(a, b)).second) << "told twice: " << a << " " << b;
    }
    return pairs;
}

/// Handed: a spiral on one side of a body.
PointCloud handed(bool mirrored) {
    PointCloud points = ellipsoidPoints(1.0, 0.6, 0.4, 4000);
    for (int i = 0; i < 2500; ++i) {
        const double t = i / 2500.0;
        const double tube = 2.399963 * i;
        points.push_back({0.9 + 0.5 * t + 0.05 * std::cos(tube),
                          0.45 * t + 0.25 * t * t + 0.05 * std::sin(tube),
                          0.9 * t * t + 0.05 * std::cos(2.0 * tube)});
    }
    if (mirrored) {
        for (Point3& p : points) p.y = -p.y;
    }
    return points;
}

TEST_F(OnlineDuplicates, AreThePairsThatScoreAtLeastTheThreshold) {
    onlineJson({"collection", "create", "dup"});
    onlineJson({"add", scans(), "--base", scans(), "--collection", "dup", "--wait"});
    for (int i = 0; i < 3; ++i) {
        onlineJson({"add", scans() + "/mug/mug_01.ply", "--key", "again/" + std::to_string(i), "--noise",
                    "0.002", "--seed", std::to_string(i + 2), "--collection", "dup", "--wait"});
    }
    std::vector<std::string> keys;
    const json listed = onlineJson({"list", "--collection", "dup"});
    for (const json& shape : listed["shapes"]) keys.push_back(shape["key"]);
    ASSERT_EQ(keys.size(), 9u);
    std::map<KeyPair, json> compared;
    for (std::size_t a = 0; a < keys.size(); ++a) {
        for (std::size_t b = a + 1; b < keys.size(); ++b) {
            compared[std::minmax(keys[a], keys[b])] =
                onlineJson({"compare", keys[a], keys[b], "--collection", "dup"});
        }
    }
    for (const char* threshold : {"0.3", "0.6", "0.9"}) {
        const json found = onlineJson({"duplicates", "dup", "--threshold", threshold});
        std::set<KeyPair> expected;
        for (const auto& [pair, one] : compared) {
            if (one["signature_score"] >= std::stod(threshold)) expected.insert(pair);
        }
        EXPECT_EQ(pairsOf(found), expected) << threshold;
        EXPECT_FALSE(expected.empty()) << threshold;
        for (const json& pair : found["pairs"]) {
            const std::string a = pair["a"];
            const std::string b = pair["b"];
            const json& one = compared.at(std::minmax(a, b));
            EXPECT_EQ(pair["signature_score"], one["signature_score"]) << a << " " << b;
            EXPECT_EQ(pair["score"], one["score"]) << a << " " << b;
            EXPECT_EQ(pair["verdict"], one["verdict"]);
        }
    }
    // The copies are in one group.
    const json wide = onlineJson({"duplicates", "--collection", "dup", "--threshold", "0.6"});
    const json best = onlineJson({"duplicates", "--collection", "dup"});
    std::set<std::string> group;
    for (const json& one : wide["groups"]) {
        const auto members = one.get<std::set<std::string>>();
        if (members.count("again/0") > 0) group = members;
    }
    for (const char* key : {"again/0", "again/1", "again/2"})
        EXPECT_EQ(group.count(key), 1u) << wide["groups"];
    const json filtered = onlineJson({"duplicates", "dup", "--filter", "@key^=again/"});
    EXPECT_EQ(filtered["shapes"], 3);
    for (const KeyPair& pair : pairsOf(filtered)) EXPECT_EQ(pairsOf(best).count(pair), 1u);
    EXPECT_FALSE(filtered["pairs"].empty());

    const std::string text = online({"duplicates", "dup"}).out;
    EXPECT_NE(text.find("have near-duplicates: "), std::string::npos) << text;
    EXPECT_NE(text.find("same "), std::string::npos) << text;
    const std::string csv = online({"duplicates", "dup", "--csv", "--no-verify"}).out;
    EXPECT_EQ(csv.rfind("group,a,b,score,signature_score,verdict,mirrored,residual\n1,", 0), 0u) << csv;
    EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), 1 + best["pairs"].size());
    const CommandRun high = online({"duplicates", "dup", "--threshold", "2"});
    EXPECT_EQ(high.exitCode, kUsage);
    EXPECT_NE(high.err.find("--threshold is 2;"), std::string::npos) << high.err;
    EXPECT_NE(online({"duplicates", "dup", "--threshold", "0.9", "--filter", "none"})
                  .out.find("no near-duplicates"),
              std::string::npos);
}

TEST_F(OnlineDuplicates, MirroredTwinsAreMarked) {
    onlineJson({"collection", "create", "twins"});
    writePoints("in/left.xyz", handed(false));
    writePoints("in/right.xyz", handed(true));
    PointCloud turned;
    for (const Point3& p : handed(false)) turned.push_back({p.y, p.z, p.x});
    writePoints("in/turned.xyz", turned);
    onlineJson({"add", path("in"), "--base", path("in"), "--collection", "twins", "--wait"});
    const json found = onlineJson({"duplicates", "twins", "--threshold", "0.8"});
    ASSERT_EQ(found["pairs"].size(), 3u) << found;
    for (const json& pair : found["pairs"]) {
        EXPECT_EQ(pair["mirrored"], pair["a"] == "right" || pair["b"] == "right") << pair;
    }
    const std::string text = online({"duplicates", "twins", "--threshold", "0.8"}).out;
    std::size_t mirrored = 0;
    for (std::size_t at = 0; (at = text.find("mirrored", at)) != std::string::npos; ++at) ++mirrored;
    EXPECT_EQ(mirrored, 1u) << "the twin that is not mirrored is shown beside the one that it is:\n" << text;
    EXPECT_NE(text.find("signatures  score"), std::string::npos) << "which of the two the threshold is for";
    EXPECT_EQ(online({"duplicates", "twins", "--no-verify"}).out.find("verdict"), std::string::npos);

    // One search tells the same in its words, its JSON and its CSV.
    const json hits =
        onlineJson({"query", path("in/right.xyz"), "--collection", "twins", "-o", path("h.csv")});
    ASSERT_EQ(hits["hits"].size(), 3u);
    for (const json& hit : hits["hits"]) EXPECT_EQ(hit["mirrored"], hit["key"] != "right") << hit;
    const std::string told = online({"query", path("in/right.xyz"), "--collection", "twins"}).out;
    EXPECT_NE(told.find("same object, mirrored"), std::string::npos) << told;
    const json compared = onlineJson({"compare", "left", "right", "--collection", "twins"});
    EXPECT_EQ(compared["mirrored"], true);
    EXPECT_EQ(onlineJson({"compare", "left", "turned", "--collection", "twins"})["mirrored"], false);
}

TEST_F(OnlineDuplicates, AreAllFoundThoughAnAnswerHasNoRoomForThem) {
    onlineJson({"collection", "create", "crowd", "--profile", "paper"});
    constexpr int kShapes = 60;  // the server gives at most 50 hits
    for (int i = 0; i < kShapes; ++i) {
        PointCloud points = dumbbellPoints(700);
        for (Point3& p : points) p.z *= 1.0 + 0.001 * i;
        writePoints("in/" + std::to_string(100 + i) + ".xyz", points);
    }
    onlineJson({"add", path("in"), "--base", path("in"), "--collection", "crowd", "--wait", "--jobs", "4"});
    const json found = onlineJson({"duplicates", "crowd", "--threshold", "0.2", "--no-verify"});
    ASSERT_EQ(found["shapes"], kShapes);
    EXPECT_EQ(found["groups"].size(), 1u);
    EXPECT_EQ(pairsOf(found).size(), static_cast<std::size_t>(kShapes * (kShapes - 1) / 2));
    for (std::size_t i = 0; i < found["pairs"].size(); i += 97) {
        const json& pair = found["pairs"][i];
        EXPECT_EQ(pair["signature_score"],
                  onlineJson({"compare", pair["a"], pair["b"], "--collection", "crowd"})["signature_score"])
            << "scored here or there, the same";
        EXPECT_TRUE(pair["mirrored"].is_null());
    }
}

TEST(DuplicateGroups, ShowEachShapeWithItsBestOfThoseBefore) {
    const auto pair = [](std::size_t a, std::size_t b, double score) {
        return DuplicatePair{a, b, score, std::nullopt};
    };
    // 0 is the mirror image of 1 and 2, which are one object; 3 hangs on 2 alone.
    const std::vector<DuplicatePair> pairs = {pair(1, 2, 0.99), pair(0, 2, 0.95), pair(0, 1, 0.94),
                                              pair(2, 3, 0.91)};
    std::vector<const DuplicatePair*> ranked;
    for (const DuplicatePair& one : pairs) ranked.push_back(&one);
    const auto links = linksOf({0, 1, 2, 3}, ranked);
    ASSERT_EQ(links.size(), 4u);
    EXPECT_EQ(links[0].pair, nullptr);
    const std::pair<std::size_t, const DuplicatePair*> expected[] = {
        {2, &pairs[1]}, {1, &pairs[0]}, {3, &pairs[3]}};
    for (std::size_t i = 1; i < links.size(); ++i) {
        EXPECT_EQ(links[i].shape, expected[i - 1].first);
        EXPECT_EQ(links[i].pair, expected[i - 1].second);
    }
    EXPECT_TRUE(linksOf({}, {}).empty());
}

TEST(DuplicateGroups, AreWhatHangsTogether) {
    const auto pair = [](std::size_t a, std::size_t b) { return DuplicatePair{a, b, 1.0, std::nullopt}; };
    using Groups = std::vector<std::vector<std::size_t>>;
    EXPECT_EQ(groupsOf({}, 5), Groups{});
    EXPECT_EQ(groupsOf({pair(3, 4), pair(0, 2), pair(2, 7)}, 9), (Groups{{0, 2, 7}, {3, 4}}));
}

}  // namespace
}  // namespace shapedb::cli
