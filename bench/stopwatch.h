// Time a thread spends computing. Other programs on a busy machine stretch the wall clock, not this.
#pragma once

#include <ctime>

namespace shapedb::bench {

/// Counts the processor time of the thread that made it; must be read by the same thread.
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
