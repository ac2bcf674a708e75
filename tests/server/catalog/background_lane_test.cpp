// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/background_lane.h"

#include <algorithm>
#include <atomic>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/support/eventually.h"

namespace shapedb::catalog {
namespace {

using testing::eventually;

TEST(BackgroundLane, RunsEachPieceOnce) {
    BackgroundLane lane(3);
    std::vector<std::atomic<int>> runs(200);
    ASSERT_TRUE(lane.run(runs.size(), [&](std::size_t i) {
        ++runs[i];
        return Result<void>();
    }));
    for (const auto& count : runs) EXPECT_EQ(count, 1);
    EXPECT_TRUE(
        lane.run(0, [](std::size_t) { return Result<void>(fail(ErrorCode::kInternal, "no piece")); }));
}

TEST(BackgroundLane, HasALowPriorityAndOneProcessorForEachPiece) {
    BackgroundLane lane(1);
    const int ours = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)));
    int theirs = 0, threads = 0;
    ASSERT_TRUE(lane.run(1, [&](std::size_t) {
        theirs = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)));
        threads = oneapi::tbb::this_task_arena::max_concurrency();
        return Result<void>();
    }));
    EXPECT_GE(theirs, std::min(ours + 10, 19));
    EXPECT_EQ(threads, 1);
}

TEST(BackgroundLane, ReturnsTheFirstErrorAndBeginsNothingAfterIt) {
    BackgroundLane lane(1);
    std::size_t begun = 0;
    const auto failed = lane.run(100, [&](std::size_t i) -> Result<void> {
        ++begun;
        if (i >= 3) return fail(ErrorCode::kNotFound, std::to_string(i));
        return {};
    });
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().message, "3");
    EXPECT_EQ(begun, 4u);
    EXPECT_TRUE(lane.run(1, [](std::size_t) { return Result<void>(); })) << "goes on afterwards";
}

TEST(BackgroundLane, ThrowsWhatAPieceThrows) {
    BackgroundLane lane(2);
    EXPECT_THROW(static_cast<void>(lane.run(5,
                                            [](std::size_t i) -> Result<void> {
                                                if (i == 2) throw std::runtime_error("piece");
                                                return {};
                                            })),
                 std::runtime_error);
    EXPECT_TRUE(lane.run(5, [](std::size_t) { return Result<void>(); }));
}

TEST(BackgroundLane, CallersTakeTurns) {
    constexpr std::size_t kLarge = 1'000;
    BackgroundLane lane(1);
    std::atomic<std::size_t> large{0};
    std::thread first([&] {
        EXPECT_TRUE(lane.run(kLarge, [&](std::size_t) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            ++large;
            return Result<void>();
        }));
    });
    ASSERT_TRUE(eventually([&] { return large > 0; }));
    std::size_t seen = 0;
    EXPECT_TRUE(lane.run(2, [&](std::size_t) {
        seen = large;
        return Result<void>();
    }));
    EXPECT_LT(seen, kLarge) << "the small one does not wait for the end of the large one";
    first.join();
    EXPECT_EQ(large, kLarge);
}

}  // namespace
}  // namespace shapedb::catalog
