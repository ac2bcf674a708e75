// SPDX-License-Identifier: GPL-3.0-or-later
// Work in many pieces that must not slow down the calls that clients wait for one by one.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "core/base/error.h"

namespace shapedb::catalog {

/// Threads of low priority (ingest::becomeBackgroundThread) that all callers share, a piece at a time in
/// turn. Thread-safe.
class BackgroundLane {
  public:
    /// `threads` at least 1.
    explicit BackgroundLane(int threads);
    /// No call of `run` may be under way.
    ~BackgroundLane();
    BackgroundLane(const BackgroundLane&) = delete;
    BackgroundLane& operator=(const BackgroundLane&) = delete;

    /// Runs `piece(0)` to `piece(count - 1)`, in this order but several at a time, each on one thread alone
    /// with its parallel loops; waits until all have ended. After an error no further piece begins; returns
    /// that of the first piece that failed. Exceptions of a piece are thrown here.
    [[nodiscard]] Result<void> run(std::size_t count, const std::function<Result<void>(std::size_t)>& piece);

  private:
    struct Job;
    void work();
    void take(std::unique_lock<std::mutex>& lock);

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Job*> waiting_;  ///< those with pieces to begin; the first is next
    bool ending_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace shapedb::catalog
