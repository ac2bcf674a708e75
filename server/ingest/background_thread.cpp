#include "server/ingest/background_thread.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace shapedb::ingest {

namespace {

/// Linux weighs a thread of this nice value with 110 where one of 0 has 1024. 19 (a weight of 15) would
/// bring segmentation to a standstill under a steady load of searches.
constexpr int kNice = 10;

}  // namespace

void becomeBackgroundThread() noexcept {
    // On Linux a nice value belongs to a thread; only its own id (not std::thread's) names one.
    const auto self = static_cast<id_t>(::syscall(SYS_gettid));
    static_cast<void>(::setpriority(PRIO_PROCESS, self, kNice));
}

}  // namespace shapedb::ingest
