// SPDX-License-Identifier: GPL-3.0-or-later
// The whole operation on a real server, at sizes that take seconds.
#include <filesystem>
#include <map>

#include "bench/load_run.h"
#include "bench/measuring.h"
#include "bench/stored_shapes.h"
#include "client/cli/console.h"
#include "core/signature/signature_codec.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

TEST(LoadRun, PercentilesAreNearestRanks) {
    EXPECT_EQ(percentile({}, 0.5), 0.0);
    EXPECT_EQ(percentile({3.0, 1.0, 2.0}, 0.5), 2.0);
    EXPECT_EQ(percentile({3.0, 1.0, 2.0, 4.0}, 0.5), 2.0);
    EXPECT_EQ(percentile({3.0, 1.0, 2.0}, 0.99), 3.0);
    EXPECT_EQ(percentile({5.0}, 0.0), 5.0);
    std::vector<double> hundred;
    for (int i = 100; i > 0; --i) hundred.push_back(i);
    EXPECT_EQ(percentile(hundred, 0.99), 99.0);
}

class LoadBench : public BenchTest {
  protected:
    /// With sizes small enough for a test.
    BenchRun load(const std::string& part, const std::map<std::string, std::string>& own = {}) {
        std::map<std::string, std::string> flags = {{"--part", part},
                                                    {"--json", "-"},
                                                    {"--server", SHAPEDBD_PATH},
                                                    {"--rounds", "1"},
                                                    {"--points", "1500"},
                                                    {"--scans", "3"},
                                                    {"--shapes", "60"},
                                                    {"--queries", "5"},
                                                    {"--start-shapes", "80"},
                                                    {"--source-points", "400"},
                                                    {"--upload-bytes", "1200000"},
                                                    {"--directory", path("")}};
        for (const auto& [name, value] : own) flags[name] = value;
        std::vector<std::string> arguments = {"load"};
        for (const auto& [name, value] : flags) arguments.insert(arguments.end(), {name, value});
        return runBench(arguments);
    }
    nlohmann::json partOf(const BenchRun& run, const std::string& part) {
        EXPECT_EQ(run.exitCode, cli::kOk) << run.err;
        const auto document = nlohmann::json::parse(run.out, nullptr, false);
        EXPECT_TRUE(document.is_object()) << run.out;
        if (!document.is_object()) return {};
        EXPECT_TRUE(document["environment"].contains("build_type"));
        EXPECT_NE(document["command"].get<std::string>().find("--part " + part), std::string::npos);
        EXPECT_EQ(document["parts"].size(), 1U);
        return document["parts"][part];
    }
};

TEST_F(LoadBench, MeasuresHowFastScansAreIngested) {
    const auto figures = partOf(load("ingest"), "ingest");
    EXPECT_EQ(figures["rounds"].size(), 1U);
    EXPECT_GT(figures["core_scans_per_second"], 0.0);
    EXPECT_GT(figures["server_scans_per_second"], 0.0);
    EXPECT_GT(figures["ratio"], 0.0);
}

TEST_F(LoadBench, MeasuresTheLatencyOfSearches) {
    const auto figures = partOf(load("latency"), "latency");
    EXPECT_EQ(figures["idle"]["queries"], 5);
    EXPECT_EQ(figures["busy"]["queries"], 5);
    EXPECT_GE(figures["idle"]["p99_seconds"], figures["idle"]["p50_seconds"]);
    EXPECT_GT(figures["p99_ratio"], 0.0);
}

TEST_F(LoadBench, StartKeepsAGivenDataDirectory) {
    const std::string data = path("kept");
    const auto made = partOf(load("startup", {{"--start-data", data}}), "startup");
    EXPECT_EQ(made["shapes"], 80);
    EXPECT_GT(made["serving_seconds"], 0.0);
    EXPECT_GE(made["first_answer_seconds"], made["serving_seconds"]);
    EXPECT_GT(made["resident_bytes"], made["cache_bytes"]);
    ASSERT_TRUE(std::filesystem::exists(data + "/shapedb.sqlite"));
    EXPECT_EQ(partOf(load("startup", {{"--start-data", data}, {"--start-shapes", "5"}}), "startup")["shapes"],
              80);
}

TEST_F(LoadBench, MeasuresHowFastPointsAreUploaded) {
    const auto figures = partOf(load("upload"), "upload");
    EXPECT_EQ(figures["point_bytes"], 1'200'000);
    EXPECT_LT(figures["growth_bytes"], 64 << 20);
    EXPECT_GT(figures["seconds"], 0.0);
}

TEST_F(LoadBench, NamesAMissingServer) {
    const BenchRun run = load("upload", {{"--server", path("none")}});
    EXPECT_EQ(run.exitCode, cli::kBadData);
    EXPECT_NE(run.err.find("--server"), std::string::npos) << run.err;
}

TEST_F(LoadBench, LeavesNothingBehind) {
    load("upload");
    for (const auto& entry : std::filesystem::directory_iterator(path("")))
        EXPECT_EQ(entry.path().filename(), "set");
}

TEST(SignatureGenerator, MadeSignaturesAreValidAndDiffer) {
    const auto source = SignatureGenerator::create({Mixture::kDuplicates, 500, 1, 400, 1}, {});
    ASSERT_TRUE(source) << source.error().message;
    std::string before;
    for (std::uint64_t i = 0; i < 500; ++i) {
        const Signature made = source->make(i);
        const std::string bytes = encodeSignature(made);
        const auto decoded = decodeSignature(bytes);
        ASSERT_TRUE(decoded) << i << ": " << decoded.error().message;
        EXPECT_NE(bytes, before);
        EXPECT_EQ(bytes, encodeSignature(source->make(i)));
        EXPECT_TRUE(sameShape(made, *decoded));
        before = bytes;
    }
}

}  // namespace
}  // namespace shapedb::bench
