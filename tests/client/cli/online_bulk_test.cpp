// SPDX-License-Identifier: GPL-3.0-or-later
// Commands on many files or shapes: what is told once, what an interrupt leaves, and results as they come;
// against a real shapedbd.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <sstream>

#include <sys/wait.h>

#include "client/api/client.h"
#include "client/cli/console.h"
#include "client/io/scan_reader.h"
#include "core/geometry/point.h"
#include "tests/client/cli/online_fixture.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class OnlineBulk : public Online {
  protected:
    static std::vector<json> linesOf(const std::string& text) {
        std::vector<json> lines;
        std::istringstream stream(text);
        for (std::string line; std::getline(stream, line);) {
            lines.push_back(json::parse(line, nullptr, false));
            EXPECT_FALSE(lines.back().is_discarded()) << line;
        }
        return lines;
    }
    /// By a shell, with "shapedb" and the server's address put in for % and @. The exit code.
    static int shell(std::string line) {
        for (std::size_t at; (at = line.find('%')) != std::string::npos;) line.replace(at, 1, SHAPEDB_PATH);
        for (std::size_t at; (at = line.find('@')) != std::string::npos;)
            line.replace(at, 1, "--server " + server()->address());
        const int status = std::system(("bash -c '" + line + "'").c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    std::string slurp(const std::string& name) const {
        std::ifstream stream(path(name));
        return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }
};

std::size_t countOf(const std::string& text, const std::string& words) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(words, at)) != std::string::npos; at += words.size()) ++count;
    return count;
}

TEST_F(OnlineBulk, AMissingCollectionIsToldOnce) {
    const std::string told = "there is no collection 'nowhere'";
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"add", scans(), "--collection", "nowhere", "--jobs", "4"},
          {"query", scans(), "--collection", "nowhere"},
          {"duplicates", "nowhere"},
          {"delete", "a", "b", "c", "--collection", "nowhere"},
          {"metadata", "a", "b", "c", "--set", "x=y", "--collection", "nowhere"}}) {
        const CommandRun run = online(arguments);
        EXPECT_NE(run.exitCode, kOk);
        EXPECT_EQ(countOf(run.err, told), 1u) << run.err;
    }
}

TEST_F(OnlineBulk, AnInterruptedWaitSaysWhatIsStored) {
    onlineJson({"collection", "create", "interrupted"});
    ASSERT_EQ(runCommand({"sample", path("in"), "--count", "4", "--points", "20000"}).exitCode, 0);
    const std::string add = "echo $$ > " + path("pid") + "; exec % add " + path("in") + " --base " +
                            path("in") + " --collection interrupted --wait @ > " + path("out") + " 2> " +
                            path("err");
    // Interrupted as soon as a scan is stored, which is long before all are segmented.
    std::future<int> code = std::async(std::launch::async, [&] { return shell(add); });
    while (onlineJson({"list", "--collection", "interrupted"})["shapes"].empty() &&
           code.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    }
    ASSERT_EQ(shell("kill -INT $(cat " + path("pid") + ")"), 0);
    EXPECT_EQ(code.get(), kInterrupted) << slurp("err");
    const std::string err = slurp("err");
    EXPECT_EQ(countOf(err, "failed"), 0u) << err;
    EXPECT_EQ(countOf(err, "\n"), 1u) << "one line: " << err;
    EXPECT_NE(err.find("interrupted: "), std::string::npos) << err;
    EXPECT_NE(slurp("out").find(" stored"), std::string::npos);
    onlineJson({"collection", "delete", "interrupted", "--force"});  // and what waits, for the next test
}

TEST_F(OnlineBulk, HeadGetsWhatItWants) {
    fill("head");
    EXPECT_EQ(shell("set -o pipefail; for i in 1 2 3; do % list --collection head @; done 2> " + path("err") +
                    " | head -n 1 > " + path("out")),
              0);
    EXPECT_EQ(slurp("err"), "");
    EXPECT_EQ(shell("set -o pipefail; % list --collection head @ --json-lines 2> " + path("err") +
                    " | (exec 0<&-; sleep 0.3)"),
              0);
    EXPECT_EQ(slurp("err"), "");
}

TEST_F(OnlineBulk, LinesOfJsonComeOneForEachItem) {
    onlineJson({"collection", "create", "lines", "--profile", "paper"});
    write("in/broken.ply", "ply\n");
    const CommandRun added =
        online({"add", scans(), path("in"), "--collection", "lines", "--wait", "--json-lines"});
    EXPECT_EQ(added.exitCode, kSomeFailed);
    const auto uploads = linesOf(added.out);
    ASSERT_EQ(uploads.size(), 7u);
    std::size_t failed = 0;
    for (const json& one : uploads) {
        EXPECT_TRUE(one.contains("file") && one.contains("key"));
        failed += one.contains("error") ? 1 : 0;
        if (!one.contains("error")) {
            EXPECT_EQ(one["state"], "ready");
        }
    }
    EXPECT_EQ(failed, 1u);

    const auto listed = linesOf(online({"list", "--collection", "lines", "--json-lines"}).out);
    EXPECT_EQ(listed.size(), 6u);
    const auto limited =
        linesOf(online({"list", "--collection", "lines", "--json-lines", "--limit", "4"}).out);
    ASSERT_EQ(limited.size(), 5u);
    EXPECT_TRUE(limited[4].contains("next_cursor"));
    const auto queries = linesOf(online({"query", scans(), "--collection", "lines", "--json-lines"}).out);
    ASSERT_EQ(queries.size(), 6u);
    EXPECT_TRUE(queries[0].contains("hits") && queries[0].contains("file"));
    EXPECT_EQ(linesOf(online({"count", "--collection", "lines", "--json-lines"}).out),
              std::vector<json>{json({{"count", 6}})})
        << "other commands have their one document";
}

TEST_F(OnlineBulk, ManyQueriesHaveTheAnswersOfEach) {
    fill("many");
    write("in/broken.ply", "ply\n");
    const std::string mug = scans() + "/mug/mug_01.ply";
    const CommandRun run = online({"query", scans() + "/mug", path("in"), "--collection", "many", "-k", "3",
                                   "-o", path("hits.csv"), "--json"});
    EXPECT_EQ(run.exitCode, kSomeFailed);
    EXPECT_NE(run.err.find("1 of 3 queries failed"), std::string::npos) << run.err;
    const json document = run.json();
    ASSERT_EQ(document["queries"].size(), 2u);
    EXPECT_EQ(document["failed"][0]["error"]["name"], "malformed_file");
    EXPECT_EQ(document["queries"][0]["file"], mug);
    const json alone = onlineJson({"query", mug, "--collection", "many", "-k", "3"});
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(document["queries"][0]["hits"][i]["key"], alone["hits"][i]["key"]);
        EXPECT_EQ(document["queries"][0]["hits"][i]["score"], alone["hits"][i]["score"]);
    }
    std::istringstream csv(slurp("hits.csv"));
    std::string line;
    std::getline(csv, line);
    EXPECT_EQ(line.rfind("query,rank,key,label,score,", 0), 0u) << line;
    const auto columns = std::count(line.begin(), line.end(), ',');
    std::size_t rows = 0;
    for (; std::getline(csv, line); ++rows) {
        EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns) << line;
        if (rows == 0) {
            EXPECT_EQ(line.rfind(mug + ",1,mug/mug_01,mug,1,1,", 0), 0u) << line;
        }
    }
    EXPECT_EQ(rows, 6u);

    const CommandRun text = online({"query", scans() + "/mug", "--collection", "many"});
    EXPECT_EQ(countOf(text.out, "rank"), 2u) << text.out;
    EXPECT_EQ(countOf(text.out, "Why "), 0u) << "reasons of many are for who asks";
    EXPECT_EQ(online({"query", mug, "-", "--format", "ply"}).exitCode, kUsage);
}

TEST_F(OnlineBulk, HitsAreWrittenWhereTheQueryIs) {
    onlineJson({"collection", "create", "aligned"});
    onlineJson({"add", scans() + "/human", "--base", scans(), "--collection", "aligned", "--wait"});
    const std::string query = scans() + "/human/human_01.ply";
    const json document =
        onlineJson({"query", query, "--collection", "aligned", "-k", "2", "--out-aligned", path("one")});
    EXPECT_EQ(document["out_aligned"], path("one"));
    const auto scan = readScan(query);
    const auto kept = readScan(path("one/query.ply"));
    const auto same = readScan(path("one/01_human_human_01.ply"));
    const auto other = readScan(path("one/02_human_human_02.ply"));
    ASSERT_TRUE(scan && kept && same && other);
    EXPECT_EQ(kept->points, scan->points);
    const auto middleOf = [](const PointCloud& points) {
        Point3 sum;
        for (const Point3& p : points) sum = sum + p;
        return (1.0 / static_cast<double>(points.size())) * sum;
    };
    const double size = length(scan->points.front() - middleOf(scan->points));
    EXPECT_LT(length(middleOf(same->points) - middleOf(scan->points)), 0.05 * size);
    EXPECT_LT(length(middleOf(other->points) - middleOf(scan->points)), 0.5 * size);
    // Of a stored query, and of several.
    onlineJson({"query", "--key", "human/human_01", "--collection", "aligned", "--out-aligned", path("key")});
    const auto stored = readScan(path("key/query.ply"));
    ASSERT_TRUE(stored);
    EXPECT_EQ(stored->points.size(), scan->points.size());
    onlineJson({"query", scans() + "/human", "--collection", "aligned", "--out-aligned", path("two")});
    std::size_t folders = 0;
    for (const auto& entry : fs::directory_iterator(path("two"))) {
        EXPECT_TRUE(fs::exists(entry.path() / "query.ply"));
        ++folders;
    }
    EXPECT_EQ(folders, 2u);
    onlineJson({"query", scans() + "/human", scans() + "/mug/mug_01.ply", "--collection", "aligned",
                "--out-aligned", path("three"), "-k", "1"});
    for (const char* name : {"human/human_01", "human/human_02", "mug/mug_01"}) {
        EXPECT_TRUE(fs::exists(path(std::string("three/") + name + "/query.ply"))) << name;
    }
}

TEST_F(OnlineBulk, PreviewsAreSomePointsOfAShape) {
    onlineJson({"collection", "create", "previews"});
    onlineJson({"add", scans() + "/mug/mug_01.ply", "--key", "mug", "--collection", "previews", "--wait"});
    onlineJson({"get", "mug", "--collection", "previews", "--preview", "--out", path("small.ply")});
    const auto scan = readScan(scans() + "/mug/mug_01.ply");
    const auto small = readScan(path("small.ply"));
    ASSERT_TRUE(scan && small);
    EXPECT_GT(small->points.size(), 300u);
    EXPECT_LT(small->points.size(), scan->points.size());
    onlineJson({"get", "mug", "--collection", "previews", "--preview"}, kUsage);
    onlineJson({"get", "none", "--collection", "previews", "--preview", "--out", path("n.ply")}, kWrongState);

    const auto client = client::Client::connect({server()->address()});
    ASSERT_TRUE(client);
    const auto previews = client->getPreviews("previews", {"none", "mug"}, 50);
    ASSERT_TRUE(previews) << previews.error().message;
    ASSERT_EQ(previews->size(), 1u);
    const client::Preview& preview = previews->front();
    EXPECT_EQ(preview.key, "mug");
    EXPECT_GT(preview.points.size(), 0u);
    EXPECT_LE(preview.points.size(), 50u);
    ASSERT_EQ(preview.normals.size(), preview.points.size());
    for (const Point3& normal : preview.normals) EXPECT_NEAR(length(normal), 1.0, 0.02);
    EXPECT_EQ(client->getPreviews("previews", {}).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(OnlineBulk, NamesThatAreNotUtf8AreRefusedInPlainWords) {
    onlineJson({"collection", "create", "names", "--profile", "paper"});
    writePoints("in/caf\xe9.xyz", dumbbellPoints());
    writePoints("in/two\nlines.xyz", dumbbellPoints());
    writePoints("in/good.xyz", dumbbellPoints());
    const CommandRun run = online({"add", path("in"), "--base", path("in"), "--collection", "names"});
    EXPECT_EQ(run.exitCode, kSomeFailed);
    EXPECT_NE(run.err.find("the key 'caf\\ufffd' is not UTF-8"), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("libprotobuf"), std::string::npos) << run.err;
    for (const std::string& text : {run.out, run.err}) {
        EXPECT_EQ(text.find("two\nlines"), std::string::npos) << text;
        EXPECT_EQ(text.find('\xe9'), std::string::npos) << text;
    }
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"get", "\xff"},
             {"list", "--filter", "a=\xff"},
             {"collection", "create", "\xff"},
             {"metadata", "good", "--set", "a=\xff", "--collection", "names"},
             {"query", "--key", "\xff"},
             {"watch", "\xff"}}) {
        const CommandRun refused = online(arguments);
        EXPECT_EQ(refused.exitCode, kUsage) << arguments[0] << ": " << refused.err;
        EXPECT_NE(refused.err.find("is not UTF-8"), std::string::npos) << arguments[0] << ": " << refused.err;
        EXPECT_EQ(refused.err.find("libprotobuf"), std::string::npos) << refused.err;
    }
}

TEST_F(OnlineBulk, FiltersAskForKeysAndAlternatives) {
    fill("filters");
    const auto keys = [&](const std::string& filter) {
        std::vector<std::string> found;
        const json hits = onlineJson({"query", "--key", "mug/mug_01", "--collection", "filters", "--filter",
                                      filter, "--include-self", "--no-explanation"});
        for (const json& hit : hits["hits"]) found.push_back(hit["key"]);
        std::sort(found.begin(), found.end());
        const json listed =
            onlineJson({"list", "--collection", "filters", "--filter", filter, "--order", "key"});
        std::vector<std::string> all;
        for (const json& shape : listed["shapes"]) all.push_back(shape["key"]);
        EXPECT_EQ(found, all) << "searches and lists agree on " << filter;
        return found;
    };
    using Names = std::vector<std::string>;
    EXPECT_EQ(keys("label=mug | label=fish"),
              (Names{"fish/fish_01", "fish/fish_02", "mug/mug_01", "mug/mug_02"}));
    EXPECT_EQ(keys("@key^=mug/"), (Names{"mug/mug_01", "mug/mug_02"}));
    EXPECT_EQ(keys("@key=mug/mug_02 | label=fish, @key!=fish/fish_01"),
              (Names{"fish/fish_02", "mug/mug_02"}));
}

TEST_F(OnlineBulk, TheQualityOfOldPointsIsNotThatOfNewOnes) {
    onlineJson({"collection", "create", "replaced"});
    const std::string good = writePoints("good.xyz", ellipsoidPoints(1.0, 0.7, 0.5, 8000));
    onlineJson({"add", good, "--key", "a", "--collection", "replaced", "--wait"});
    EXPECT_TRUE(onlineJson({"get", "a", "--collection", "replaced"}).contains("quality"));
    // Enough to keep the server busy while it is asked.
    const std::string large = writePoints("large.xyz", ellipsoidPoints(1.0, 0.9, 0.5, 200'000));
    onlineJson({"add", large, "--key", "a", "--collection", "replaced", "--replace"});
    const json waiting = onlineJson({"get", "a", "--collection", "replaced"});
    ASSERT_EQ(waiting["state"], "pending");
    EXPECT_FALSE(waiting.contains("quality")) << waiting;
    EXPECT_FALSE(onlineJson({"list", "--collection", "replaced"})["shapes"][0].contains("quality"));
    onlineJson({"watch", "a", "--collection", "replaced"});
    EXPECT_TRUE(onlineJson({"get", "a", "--collection", "replaced"}).contains("quality"));
}

TEST_F(OnlineBulk, MessagesOfTheServerSpeakOfFlags) {
    fill("words");
    const auto told = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), {"--collection", "words"});
        const CommandRun run = online(arguments);
        EXPECT_NE(run.exitCode, kOk) << run.out;
        return run.err;
    };
    EXPECT_EQ(told({"query", "--key", "mug/mug_01", "--threshold", "90"}).rfind("shapedb: --threshold: ", 0),
              0u);
    EXPECT_EQ(told({"query", "--key", "mug/mug_01", "-k", "0"}).rfind("shapedb: -k: ", 0), 0u);
    EXPECT_EQ(told({"query", "--key", "mug/mug_01", "--group-by", "a b"}).rfind("shapedb: --group-by: ", 0),
              0u);
    const CommandRun full = online({"collection", "delete", "words"});
    EXPECT_NE(full.err.find("--force does that"), std::string::npos) << full.err;
    for (const std::string& err : {full.err, told({"signature", "none"})}) {
        EXPECT_EQ(err.find("WatchIngest"), std::string::npos) << err;
        EXPECT_EQ(err.find("set force"), std::string::npos) << err;
    }
}

}  // namespace
}  // namespace shapedb::cli
