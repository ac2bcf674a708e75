// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/background_thread.h"

#include <oneapi/tbb/task_arena.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace shapedb::ingest {

namespace {

/// Linux gives a thread with this difference in niceness about a tenth of the weight. 19 (a seventieth)
/// would stall segmentation under a steady load of searches.
constexpr int kNicer = 10;

}  // namespace

void becomeBackgroundThread() noexcept {
    // On Linux niceness belongs to a thread, named by its kernel id.
    const auto self = static_cast<id_t>(::syscall(SYS_gettid));
    // Relative, since the whole server may run with another niceness. -1 may be an error or a value.
    const int now = ::getpriority(PRIO_PROCESS, self);
    static_cast<void>(::setpriority(PRIO_PROCESS, self, now + kNicer));
}

void onThisThreadAlone(const std::function<void()>& work) {
    // The threads of the pool are not background threads, and the other workers keep the processors busy.
    oneapi::tbb::task_arena alone(1);
    alone.execute(work);
}

}  // namespace shapedb::ingest
