#include "server/ingest/background_thread.h"

#include <oneapi/tbb/task_arena.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace shapedb::ingest {

namespace {

/// Linux weighs a thread so much nicer than another with about a tenth. 19 (a weight of a seventieth) would
/// bring segmentation to a standstill under a steady load of searches.
constexpr int kNicer = 10;

}  // namespace

void becomeBackgroundThread() noexcept {
    // On Linux a nice value belongs to a thread; only its own id (not std::thread's) names one.
    const auto self = static_cast<id_t>(::syscall(SYS_gettid));
    // Relative: an operator may have started the whole server nicer. -1, the sign of an error too, is a
    // value.
    const int now = ::getpriority(PRIO_PROCESS, self);
    static_cast<void>(::setpriority(PRIO_PROCESS, self, now + kNicer));
}

void onThisThreadAlone(const std::function<void()>& work) {
    oneapi::tbb::task_arena alone(1);
    alone.execute(work);
}

}  // namespace shapedb::ingest
