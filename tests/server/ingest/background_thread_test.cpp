// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/background_thread.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

namespace shapedb::ingest {
namespace {

int niceOfThisThread() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid))); }

TEST(BackgroundThread, LowersOnlyTheCallingThread) {
    const int before = niceOfThisThread();
    int inside = before;
    std::thread thread([&] {
        becomeBackgroundThread();
        inside = niceOfThisThread();
    });
    thread.join();
    EXPECT_EQ(inside, std::min(19, before + 10));
    EXPECT_EQ(niceOfThisThread(), before);
}

TEST(BackgroundThread, RunsParallelLoopsOnOneThread) {
    std::atomic<int> elsewhere{0};
    const std::thread::id self = std::this_thread::get_id();
    onThisThreadAlone([&] {
        EXPECT_EQ(tbb::this_task_arena::max_concurrency(), 1) << "no other thread can join";
        tbb::parallel_for(0, 64, [&](int) { elsewhere += std::this_thread::get_id() == self ? 0 : 1; });
    });
    EXPECT_EQ(elsewhere, 0);
}

}  // namespace
}  // namespace shapedb::ingest
