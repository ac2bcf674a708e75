#include "server/ingest/background_thread.h"

#include <algorithm>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace shapedb::ingest {
namespace {

int niceOfThisThread() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid))); }

TEST(BackgroundThread, LowersOnlyTheThreadThatAsks) {
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

}  // namespace
}  // namespace shapedb::ingest
