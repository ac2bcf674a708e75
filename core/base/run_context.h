// SPDX-License-Identifier: Apache-2.0
// Cancellation, deadline and progress of long-running work.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>

#include "core/base/error.h"

namespace shapedb {

/// Passed by const reference to everything that may run for long. A default-constructed context never stops
/// the work and reports to nobody.
///
/// Thread-safety: `checkpoint` may be called from any number of threads at once;
/// `progress` is called only from the thread that called the long-running function.
struct RunContext {
    using Clock = std::chrono::steady_clock;

    /// Another thread sets this to true to stop the work. Not owned; may be null.
    const std::atomic<bool>* cancel = nullptr;

    /// Once this has passed, the work stops with kDeadlineExceeded.
    Clock::time_point deadline = Clock::time_point::max();

    /// Called at the start of each stage and from time to time during long ones, with the stage's name
    /// (static storage) and its progress in the stage's own unit (total 0: unknown).
    std::function<void(const char* stage, std::uint64_t done, std::uint64_t total)> progress;

    /// An error (kCancelled or kDeadlineExceeded) when the work should stop. Costs an atomic load and, with a
    /// deadline, a clock read: call it every few thousand steps.
    [[nodiscard]] Result<void> checkpoint() const {
        if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) {
            return fail(ErrorCode::kCancelled, "cancelled by the caller");
        }
        if (deadline != Clock::time_point::max() && Clock::now() >= deadline) {
            return fail(ErrorCode::kDeadlineExceeded, "the deadline passed before the work was done");
        }
        return {};
    }

    void report(const char* stage, std::uint64_t done, std::uint64_t total) const {
        if (progress) progress(stage, done, total);
    }
};

}  // namespace shapedb
