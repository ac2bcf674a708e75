// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/run_context.h"

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

TEST(RunContext, DefaultContextNeverStops) {
    const RunContext context;
    EXPECT_TRUE(context.checkpoint());
    context.report("stage", 1, 2);  // reports to nobody
}

TEST(RunContext, AnotherThreadCanCancel) {
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_TRUE(context.checkpoint());
    std::thread([&] { cancel = true; }).join();
    const auto stopped = context.checkpoint();
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

TEST(RunContext, DeadlineStopsOnceItHasPassed) {
    RunContext context;
    context.deadline = RunContext::Clock::now() + hours(1);
    EXPECT_TRUE(context.checkpoint());
    context.deadline = RunContext::Clock::now() - milliseconds(1);
    const auto stopped = context.checkpoint();
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kDeadlineExceeded);
}

TEST(RunContext, CancellationTakesPrecedenceOverTheDeadline) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    context.deadline = RunContext::Clock::now() - milliseconds(1);
    EXPECT_EQ(context.checkpoint().error().code, ErrorCode::kCancelled);
}

TEST(RunContext, ReportReachesTheProgressCallback) {
    std::vector<std::tuple<std::string, std::uint64_t, std::uint64_t>> heard;
    RunContext context;
    context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t total) {
        heard.emplace_back(stage, done, total);
    };
    context.report("delaunay", 0, 100);
    context.report("flow", 7, 0);
    const decltype(heard) expected = {{"delaunay", 0, 100}, {"flow", 7, 0}};
    EXPECT_EQ(heard, expected);
}

}  // namespace
}  // namespace shapedb
