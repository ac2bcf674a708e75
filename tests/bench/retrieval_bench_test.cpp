// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>

#include <gmock/gmock.h>

#include "bench/peers.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class RetrievalBench : public BenchTest {
  protected:
    static BenchRun retrieval(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "retrieval");
        return runBench(std::move(arguments));
    }
};

TEST_F(RetrievalBench, MeasuresEveryMethodAtEveryNoiseLevel) {
    const BenchRun run = retrieval({set(), "--noise", "0,0.01", "--json", path("out.json"), "--plot",
                                    path("out.svg"), "--markdown", path("out.md")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_THAT(run.out, AllOf(HasSubstr("9 queries of 3 classes"), HasSubstr("no noise added"),
                               HasSubstr("noise 1 % of the diagonal"), HasSubstr("ShapeDB default"),
                               HasSubstr("ShapeDB paper"), HasSubstr("D2"), HasSubstr("describe / D2")));
    const json document = json::parse(read("out.json"));
    ASSERT_EQ(document["levels"].size(), 2u);
    EXPECT_EQ(document["levels"][1]["noise"], 0.01);
    EXPECT_EQ(document["shapes"], 9);
    for (const json& level : document["levels"]) {
        ASSERT_EQ(level["methods"].size(), peerLibrary().empty() ? 3u : 6u);
        for (const json& method : level["methods"]) {
            for (const char* key : {"nn", "first_tier", "second_tier", "dcg", "map"}) {
                EXPECT_GE(method[key].get<double>(), 0.0) << key;
                EXPECT_LE(method[key].get<double>(), 1.0) << key;
            }
            EXPECT_EQ(method["precision_at_recall"].size(), 20u);
            EXPECT_GT(method["describe_per_d2"].get<double>(), 0.0);
        }
        EXPECT_EQ(level["methods"].back()["name"], "d2");
        EXPECT_EQ(level["methods"].back()["describe_per_d2"], 1.0);
    }
    EXPECT_THAT(read("out.md"), AllOf(HasSubstr("| ShapeDB default |"), HasSubstr("|---|")));
    EXPECT_THAT(read("out.svg"), AllOf(HasSubstr("<svg"), HasSubstr("recall"), HasSubstr("mAP")));
}

TEST_F(RetrievalBench, SaysWhetherThePeersWereBuilt) {
    const BenchRun run = retrieval({set(), "--methods", "d2", "--noise", "0"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    if (peerLibrary().empty()) {
        EXPECT_THAT(run.out, HasSubstr("not built in"));
    } else {
        EXPECT_THAT(run.out, AllOf(HasSubstr(peerLibrary()), Not(HasSubstr("not built in"))));
    }
}

TEST_F(RetrievalBench, JsonOnStandardOutputIsAlone) {
    const BenchRun run = retrieval({set(), "--methods", "d2", "--noise", "0", "--json", "-"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const json document = json::parse(run.out);
    EXPECT_EQ(document["levels"][0]["methods"][0]["nn"], 1.0);
    EXPECT_EQ(document["rotated"], true);
}

TEST_F(RetrievalBench, ClassesCanBeChosen) {
    const BenchRun run =
        retrieval({set(), "--methods", "d2", "--noise", "0", "--except-classes", "rod", "--json", "-"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(json::parse(run.out)["shapes"], 6);
    EXPECT_EQ(retrieval({set(), "--methods", "d2", "--classes", "rods"}).exitCode, 2);
}

TEST_F(RetrievalBench, GalleryTellsTheRankOfEveryQuery) {
    const BenchRun run =
        retrieval({set() + "/rod/1.xyz", "--gallery", set(), "--methods", "d2", "--json", path("out.json")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_THAT(run.out, AllOf(HasSubstr("hit at 1"), HasSubstr("mrr"), HasSubstr("1.xyz")));
    const json method = json::parse(read("out.json"))["levels"][0]["methods"][0];
    EXPECT_EQ(method["mrr"], 1.0);
    ASSERT_EQ(method["ranks"].size(), 1u);
    EXPECT_EQ(method["ranks"][0]["rank"], 1);
}

TEST_F(RetrievalBench, WithoutD2ThereAreNoRatios) {
    const BenchRun run = retrieval({set(), "--methods", "paper", "--noise", "0", "--json", path("out.json")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_FALSE(json::parse(read("out.json"))["levels"][0]["methods"][0].contains("describe_per_d2"));
}

TEST_F(RetrievalBench, AnUnreadableFileIsNamedOnceAndMakesTheExitCodeOne) {
    write("set/rod/broken.ply", "ply\nformat ascii 1.0\nelement vertex 10\n");
    const BenchRun run = retrieval({set(), "--methods", "paper,d2", "--noise", "0"});
    EXPECT_EQ(run.exitCode, 1);
    const std::size_t first = run.err.find("broken.ply");
    ASSERT_NE(first, std::string::npos);
    EXPECT_EQ(run.err.find("shapedb-bench:", first), std::string::npos) << run.err;
}

TEST_F(RetrievalBench, BadArgumentsAreRefusedInWords) {
    const auto refused = [&](std::vector<std::string> arguments, const char* word, int exitCode = 2) {
        const BenchRun run = retrieval(std::move(arguments));
        EXPECT_EQ(run.exitCode, exitCode) << run.err;
        EXPECT_THAT(run.err, AllOf(HasSubstr("shapedb-bench: "), HasSubstr(word)));
    };
    refused({}, "DIR");
    refused({set(), "--noise", "-1"}, "-1");
    refused({set(), "--noise", "0,x"}, "x");
    refused({set(), "--methods", "sift"}, "'sift'");
    refused({set(), set()}, "one folder");
    refused({set(), "--gallery", set(), "--match", "colour"}, "colour");
    refused({set(), "--gallery", set(), "--plot", path("x.svg")}, "--plot");
    refused({set(), "--gallery", set(), "--classes", "rod"}, "--classes");
    refused({set() + "/rod", "--methods", "d2"}, "class folder");
    refused({path("nowhere"), "--methods", "d2"}, "nowhere", 3);
    refused({set(), "--methods", "d2", "--points", "3"}, "--points");
    refused({set(), "--methods", "d2", "--noise", "0", "--plot", path("no/such/x.svg")}, "x.svg", 3);
}

TEST_F(RetrievalBench, AnErrorIsJsonToo) {
    const BenchRun run = retrieval({path("nowhere"), "--json", "-"});
    EXPECT_EQ(run.exitCode, 3);
    EXPECT_EQ(json::parse(run.out)["error"]["name"], "file_not_readable");
}

TEST(Program, NamesItsOperationsAndVersion) {
    EXPECT_THAT(runBench({"--help"}).out, HasSubstr("retrieval"));
    EXPECT_THAT(runBench({"--version"}).out, HasSubstr("shapedb-bench "));
    EXPECT_EQ(runBench({}).exitCode, 2);
    EXPECT_EQ(runBench({"retrieve"}).exitCode, 2);
}

}  // namespace
}  // namespace shapedb::bench
