#include "server/ingest/background_thread.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <tbb/parallel_for.h>
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
    std::mutex mutex;
    std::set<std::thread::id> threads;
    onThisThreadAlone([&] {
        tbb::parallel_for(0, 64, [&](int) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            const std::lock_guard<std::mutex> lock(mutex);
            threads.insert(std::this_thread::get_id());
        });
    });
    EXPECT_EQ(threads, std::set<std::thread::id>{std::this_thread::get_id()});
}

}  // namespace
}  // namespace shapedb::ingest
