// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <sstream>

#include "client/cli/console.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

class FingerprintBench : public BenchTest {
  protected:
    static std::vector<std::string> linesOf(const BenchRun& run) {
        EXPECT_EQ(run.exitCode, cli::kOk) << run.err;
        std::vector<std::string> lines;
        std::istringstream text(run.out);
        for (std::string line; std::getline(text, line);) lines.push_back(line);
        return lines;
    }
};

TEST_F(FingerprintBench, IsTheSameForAnyNumberOfThreads) {
    const auto one = linesOf(runBench({"fingerprint", set(), "--threads", "1"}));
    const auto three = linesOf(runBench({"fingerprint", set(), "--threads", "3"}));
    EXPECT_EQ(one, three);
    // For each of two profiles a line for each of nine scans, one for all, and one for each of eight options.
    EXPECT_EQ(one.size(), 2U * (9 + 1 + 8));
}

TEST_F(FingerprintBench, ShowsWhichScanChanged) {
    const std::string other = writePoints("set/cube/other.xyz", boxPoints(1.0, 1.0, 1.0, 300, 50));
    const std::vector<std::string> command = {"fingerprint", set(), "--profile", "default"};
    const auto before = linesOf(runBench(command));
    // One coordinate of ten points, by a tenth.
    PointCloud points = boxPoints(1.0, 1.0, 1.0, 300, 50);
    for (std::size_t i = 0; i < 10; ++i) points[i].x += 0.1;
    ASSERT_EQ(writePoints("set/cube/other.xyz", points), other);
    const auto after = linesOf(runBench(command));
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) {
        const bool isAnotherScan =
            before[i].find(".xyz") != std::string::npos && before[i].find("other.xyz") == std::string::npos;
        EXPECT_EQ(before[i] == after[i], isAnotherScan) << before[i];
    }
}

TEST_F(FingerprintBench, AScanWithoutAnInteriorIsNamedByItsError) {
    write("flat.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n");
    const auto lines = linesOf(runBench({"fingerprint", path("flat.xyz"), set(), "--profile", "default"}));
    const auto flat = std::find_if(lines.begin(), lines.end(), [](const auto& line) {
        return line.find("flat.xyz") != std::string::npos;
    });
    ASSERT_NE(flat, lines.end());
    EXPECT_NE(flat->find("signature coplanar"), std::string::npos) << *flat;
}

}  // namespace
}  // namespace shapedb::bench
