// How long-running work is cancelled and how it reports where it stands.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>

#include "core/base/error.h"

namespace shapedb {

/// Passed by const reference to everything that can take longer than a moment. The
/// default-constructed context never cancels and reports to nobody.
///
/// Thread-safety: `checkpoint` may be called from any number of threads at once;
/// `progress` is called only from the thread that called the long-running function.
struct RunContext {
    using Clock = std::chrono::steady_clock;

    /// Set to true by another thread to stop the work; not owned; may be null.
    const std::atomic<bool>* cancel = nullptr;

    /// Moment after which the work stops with kDeadlineExceeded.
    Clock::time_point deadline = Clock::time_point::max();

    /// Called at the start of each stage and now and then inside long ones: the stage's
    /// name (static storage), and done of total in the stage's own unit (total 0: unknown).
    std::function<void(const char* stage, std::uint64_t done, std::uint64_t total)> progress;

    /// Empty result to go on, kCancelled or kDeadlineExceeded to stop. Costs an atomic
    /// load and, with a deadline, a clock read: call it every few thousand steps.
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
