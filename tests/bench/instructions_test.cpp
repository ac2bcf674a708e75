// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/instructions.h"

#include <filesystem>

#include "bench/jobs.h"
#include "client/cli/console.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

constexpr double kMargin = 0.03;

Counts counts(std::map<std::string, std::uint64_t> jobs) {
    return {{"g++ 12.2.0", "Release", "2.36", "valgrind-3.19.0", "avx2"}, std::move(jobs)};
}

JobVerdict::Kind kindAt(std::uint64_t measured) {
    return compareCounts(counts({{"a", 1'000}}), counts({{"a", measured}}), kMargin).jobs.at(0).kind;
}

TEST(Instructions, GrowthBeyondTheMarginFails) {
    EXPECT_EQ(kindAt(1'000), JobVerdict::Kind::kSame);
    EXPECT_EQ(kindAt(1'030), JobVerdict::Kind::kSame);
    EXPECT_EQ(kindAt(1'031), JobVerdict::Kind::kMore);
    EXPECT_EQ(kindAt(970), JobVerdict::Kind::kSame);
    EXPECT_EQ(kindAt(969), JobVerdict::Kind::kLess);
    const Counts baseline = counts({{"a", 1'000}, {"b", 1'000}});
    const Counts grown = counts({{"a", 500}, {"b", 1'031}});
    const Verdict verdict = compareCounts(baseline, grown, kMargin);
    EXPECT_TRUE(verdict.failed());
    const std::string text = verdictText(verdict, baseline, grown, kMargin);
    EXPECT_NE(text.find("| b | 1,000 | 1,031 | +3.10 % | MORE |"), std::string::npos) << text;
    EXPECT_NE(text.find("| a | 1,000 | 500 | -50.00 % | fewer |"), std::string::npos) << text;
    EXPECT_NE(text.find("FAILED"), std::string::npos);
}

TEST(Instructions, FewerInstructionsPass) {
    const Verdict verdict = compareCounts(counts({{"a", 1'000}}), counts({{"a", 500}}), kMargin);
    EXPECT_FALSE(verdict.failed());
}

TEST(Instructions, FailsUnlessTheBaselineListsExactlyTheJobs) {
    EXPECT_TRUE(compareCounts(counts({}), counts({{"a", 1}}), kMargin).failed());
    EXPECT_TRUE(compareCounts(counts({{"a", 1}}), counts({}), kMargin).failed());
}

TEST(Instructions, ADifferentEnvironmentIsReportedAndNotAFailure) {
    const Counts baseline = counts({{"a", 1'000}});
    Counts elsewhere = counts({{"a", 2'000}});
    elsewhere.environment.compiler = "g++ 13.1.0";
    const Verdict verdict = compareCounts(baseline, elsewhere, kMargin);
    EXPECT_FALSE(verdict.comparable);
    EXPECT_FALSE(verdict.failed());
    const std::string text = verdictText(verdict, baseline, elsewhere, kMargin);
    EXPECT_NE(text.find("NOT COMPARED"), std::string::npos);
    EXPECT_NE(text.find("g++ 13.1.0"), std::string::npos);
}

TEST(Instructions, FilesRoundTrip) {
    const Counts written = counts({{"a", 1}, {"b", 123'456'789'012}});
    const auto read = parseCounts(countsText(written));
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->environment == written.environment);
    EXPECT_EQ(read->jobs, written.jobs);
    for (const char* damaged : {"", "[]", "{}", R"({"environment": {}, "instructions": {"a": 1}})",
                                R"({"environment": 1, "instructions": {}})"}) {
        EXPECT_EQ(parseCounts(damaged).error().code, ErrorCode::kMalformedFile) << damaged;
    }
}

/// The whole operation, with a stand-in for valgrind that reports the count a test chooses.
class InstructionsOperation : public BenchTest {
  protected:
    InstructionsOperation() { write("signatures", "already there"); }

    BenchRun runWith(const std::string& count, std::vector<std::string> more = {}) {
        const std::string tool = write("valgrind-" + count,
                                       "#!/bin/sh\n"
                                       "[ \"$1\" = --version ] && echo valgrind-0 && exit 0\n"
                                       "echo 'summary: " +
                                           count + "' > \"${2#--callgrind-out-file=}\"\n");
        std::filesystem::permissions(tool, std::filesystem::perms::owner_all);
        std::vector<std::string> arguments = {
            "instructions", path("counts.json"), "--valgrind", tool, "--program",
            "true",         "--folder",          path("")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runBench(arguments);
    }
};

TEST_F(InstructionsOperation, FailsWhenACountGrows) {
    const BenchRun updated = runWith("1000", {"--update"});
    ASSERT_EQ(updated.exitCode, cli::kOk) << updated.err;
    EXPECT_EQ(runWith("1000").exitCode, cli::kOk);
    EXPECT_EQ(runWith("1029").exitCode, cli::kOk);
    const BenchRun grown = runWith("1031");
    EXPECT_EQ(grown.exitCode, cli::kSomeFailed);
    for (const Job& job : jobs()) EXPECT_NE(grown.out.find(job.name), std::string::npos) << job.name;
    EXPECT_EQ(runWith("1031", {"--margin", "0.05"}).exitCode, cli::kOk);
}

TEST_F(InstructionsOperation, SaysWhatIsMissing) {
    const BenchRun noBaseline = runWith("1000");
    EXPECT_EQ(noBaseline.exitCode, cli::kBadData) << noBaseline.err;
    ASSERT_EQ(runWith("1000", {"--update"}).exitCode, cli::kOk);
    const BenchRun noValgrind = runBench({"instructions", path("counts.json"), "--valgrind", path("none")});
    EXPECT_NE(noValgrind.exitCode, cli::kOk);
    EXPECT_NE(noValgrind.err.find("install-deps.sh"), std::string::npos) << noValgrind.err;
    // Nothing counted is no count of zero.
    EXPECT_EQ(runWith("0").exitCode, cli::kDefect);
}

TEST_F(BenchTest, JobsRunByThemselves) {
    for (const char* name : {"store-200", "ply-100000"}) {
        write("signatures", "not needed");
        const BenchRun run = runBench({"job", name, "--folder", path("")});
        EXPECT_EQ(run.exitCode, cli::kOk) << name << ": " << run.err;
    }
    const BenchRun damaged = runBench({"job", "score-2000", "--folder", path("")});
    EXPECT_NE(damaged.exitCode, cli::kOk);
    EXPECT_EQ(runBench({"job", "none"}).exitCode, cli::kUsage);
}

}  // namespace
}  // namespace shapedb::bench
