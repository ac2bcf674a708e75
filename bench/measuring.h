// SPDX-License-Identifier: GPL-3.0-or-later
// What operations measure with: order statistics, processor time, peak memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace shapedb::bench {

/// Smallest value that at least `share` of the values do not exceed; 0 if there are none.
[[nodiscard]] inline double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

[[nodiscard]] inline double median(std::vector<double> values) { return percentile(std::move(values), 0.5); }

/// Median of the ratios of values measured right after each other; changes in the machine's speed affect it
/// less than the ratio of medians. Both must have the same size.
[[nodiscard]] inline double medianRatio(const std::vector<double>& of, const std::vector<double>& to) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < of.size(); ++i) ratios.push_back(of[i] / to[i]);
    return median(std::move(ratios));
}

// Processor time of a thread, which other load on the machine affects less than wall time.

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

// Peak memory of a piece of work, whatever this process did before.

/// Runs `work` in a forked child and returns the child's peak resident memory in bytes, above that of a
/// child that does nothing; nothing if the child cannot be started or fails. Call it before this
/// process starts threads: the child has only the one that forked.
[[nodiscard]] std::optional<std::size_t> peakMemoryOf(const std::function<bool()>& work);

}  // namespace shapedb::bench
