// SPDX-License-Identifier: GPL-3.0-or-later
// Processor time of a thread, which other load on the machine affects less than wall time.
#pragma once

#include <ctime>

namespace shapedb::bench {

/// Measures the thread that made it; read it on the same thread.
class ThreadStopwatch {
  public:
    /// Seconds since construction.
    [[nodiscard]] double seconds() const { return now() - start_; }

  private:
    static double now() {
        std::timespec time{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
        return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    }

    double start_ = now();
};

}  // namespace shapedb::bench
