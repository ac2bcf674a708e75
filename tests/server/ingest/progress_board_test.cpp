// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/progress_board.h"

#include <thread>

#include <gtest/gtest.h>

#include "tests/support/eventually.h"

namespace shapedb::ingest {
namespace {

using namespace std::chrono_literals;

ProgressBoard::Clock::time_point in(std::chrono::milliseconds time) {
    return ProgressBoard::Clock::now() + time;
}

TEST(ProgressBoard, UnknownShapeIsQueued) {
    ProgressBoard board;
    const auto watch = board.watch(1);
    EXPECT_EQ(watch->status().stage, "queued");
    EXPECT_EQ(watch->status().total, 0u);
}

TEST(ProgressBoard, StagesAreSeenByWhoComesLater) {
    ProgressBoard board;
    board.report(1, "delaunay", 3, 10);
    const auto watch = board.watch(1);
    EXPECT_EQ(watch->status().stage, "delaunay");
    EXPECT_EQ(watch->status().done, 3u);
    EXPECT_EQ(watch->status().total, 10u);
    board.settled(1);
    EXPECT_EQ(watch->status().stage, "queued");
    EXPECT_EQ(board.watch(2)->status().stage, "queued");
}

TEST(ProgressBoard, ChangeWakesTheWatcher) {
    ProgressBoard board;
    const auto watch = board.watch(1);
    const auto before = watch->status().sequence;
    const auto began = ProgressBoard::Clock::now();
    std::thread worker([&] {
        EXPECT_TRUE(testing::eventually([&] { return board.waiting(1) == 1; }));
        board.report(1, "flow", 0, 0);
    });
    watch->waitForChange(before, in(10s));
    EXPECT_LT(ProgressBoard::Clock::now() - began, 5s) << "woken, not timed out";
    worker.join();
    EXPECT_EQ(watch->status().stage, "flow");
    EXPECT_GT(watch->status().sequence, before);
}

TEST(ProgressBoard, ChangeBeforeTheWaitIsNotMissed) {
    ProgressBoard board;
    const auto watch = board.watch(1);
    const auto before = watch->status().sequence;
    board.settled(1);
    const auto began = ProgressBoard::Clock::now();
    watch->waitForChange(before, in(10s));
    EXPECT_LT(ProgressBoard::Clock::now() - began, 5s);
}

TEST(ProgressBoard, WaitEndsAtItsTime) {
    ProgressBoard board;
    const auto watch = board.watch(1);
    board.settled(2);
    const auto began = ProgressBoard::Clock::now();
    watch->waitForChange(watch->status().sequence, in(30ms));
    EXPECT_GE(ProgressBoard::Clock::now() - began, 30ms);
}

TEST(ProgressBoard, ManyReportsOfOneStageAreFewAnnouncements) {
    ProgressBoard board;
    const auto watch = board.watch(1);
    board.report(1, "flow", 0, 1'000'000);
    const auto before = watch->status().sequence;
    const auto began = ProgressBoard::Clock::now();
    for (std::uint64_t i = 1; i <= 10'000; ++i) board.report(1, "flow", i, 1'000'000);
    const auto announcements = watch->status().sequence - before;
    EXPECT_LE(announcements, static_cast<std::uint64_t>((ProgressBoard::Clock::now() - began) / 50ms) + 1);
    EXPECT_EQ(watch->status().done, 10'000u) << "who looks sees the newest";
    board.report(1, "merge", 0, 0);
    EXPECT_EQ(watch->status().sequence, before + announcements + 1) << "a new stage is told at once";
}

}  // namespace
}  // namespace shapedb::ingest
