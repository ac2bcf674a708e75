// SPDX-License-Identifier: GPL-3.0-or-later
// Threads that repeat a piece of work until they are stopped.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/base/error.h"

namespace shapedb::bench {

/// Runs `work(i)` for i = 0, 1, ... on that many threads until it returns false or fails; returns the first
/// error. `work` must end soon after `stop` is set.
class WorkLoop {
  public:
    using Work = std::function<Result<bool>(std::size_t i)>;

    WorkLoop(unsigned threads, std::atomic<bool>& stop, Work work) : stop_(stop), work_(std::move(work)) {
        for (unsigned t = 0; t < threads; ++t) threads_.emplace_back([this] { run(); });
    }
    ~WorkLoop() {
        stop_ = true;
        static_cast<void>(finish());
    }
    WorkLoop(const WorkLoop&) = delete;
    WorkLoop& operator=(const WorkLoop&) = delete;

    Result<void> finish() {
        for (std::thread& thread : threads_) thread.join();
        threads_.clear();
        if (error_) return fail(*error_);
        return {};
    }

  private:
    void run() {
        while (!stop_) {
            const Result<bool> more = work_(next_.fetch_add(1));
            if (more && *more) continue;
            if (!more) {
                const std::lock_guard<std::mutex> lock(mutex_);
                if (!error_ && !stop_) error_ = more.error();
                stop_ = true;
            }
            return;
        }
    }

    std::atomic<bool>& stop_;
    Work work_;
    std::atomic<std::size_t> next_{0};
    std::mutex mutex_;
    std::optional<Error> error_;
    std::vector<std::thread> threads_;
};

}  // namespace shapedb::bench
