// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/telemetry/metrics.h"

#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb::telemetry {
namespace {

bool has(const std::string& page, const std::string& line) {
    return page.find("\n" + line + "\n") != std::string::npos;
}

TEST(Metrics, CountsCallsByRpcAndCode) {
    Metrics metrics;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&] {
            for (int i = 0; i < 1'000; ++i) metrics.recordCall("AddShape", "OK", 0.02, 12);
        });
    }
    for (std::thread& thread : threads) thread.join();
    metrics.recordCall("AddShape", "NOT_FOUND", 5.0, 0);
    const std::string page = metrics.page();
    EXPECT_TRUE(has(page, R"(shapedb_calls_total{code="OK",rpc="AddShape"} 4000)")) << page;
    EXPECT_TRUE(has(page, R"(shapedb_calls_total{code="NOT_FOUND",rpc="AddShape"} 1)")) << page;
    EXPECT_TRUE(has(page, R"(shapedb_call_duration_seconds_bucket{rpc="AddShape",le="0.01"} 0)")) << page;
    EXPECT_TRUE(has(page, R"(shapedb_call_duration_seconds_bucket{rpc="AddShape",le="0.03"} 4000)")) << page;
    EXPECT_TRUE(has(page, R"(shapedb_call_duration_seconds_bucket{rpc="AddShape",le="+Inf"} 4001)")) << page;
    EXPECT_TRUE(has(page, "shapedb_received_point_bytes_total 48000")) << page;
}

TEST(Metrics, AsksForTheStateEachTime) {
    Metrics metrics;
    double value = 1.0;
    metrics.setSampler([&]() -> std::vector<Sample> {
        return {{"a_bytes", "A.", Sample::Kind::kGauge, value, {{"state", "x"}}},
                {"a_bytes", "A.", Sample::Kind::kGauge, 2.0, {{"state", "y"}}},
                {"b_total", "B.", Sample::Kind::kCounter, 3.0}};
    });
    EXPECT_TRUE(has(metrics.page(), R"(a_bytes{state="x"} 1)"));
    value = 7.0;
    const std::string page = metrics.page();
    EXPECT_TRUE(has(page, R"(a_bytes{state="x"} 7)")) << page;
    EXPECT_TRUE(has(page, R"(a_bytes{state="y"} 2)"));
    EXPECT_TRUE(has(page, "# TYPE b_total counter"));
    EXPECT_EQ(page.find("# TYPE a_bytes"), page.rfind("# TYPE a_bytes")) << "one family";
}

TEST(Metrics, SaysWhenItCannotListen) {
    Metrics first, second;
    const auto port = first.serve("127.0.0.1:0");
    ASSERT_TRUE(port);
    const auto taken = second.serve("127.0.0.1:" + std::to_string(*port));
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().code, ErrorCode::kUnavailable);
    first.stop();
    first.stop();
}

}  // namespace
}  // namespace shapedb::telemetry
