// SPDX-License-Identifier: GPL-3.0-or-later
// Counts of the database that need not be exact at every look: counting reads whole tables, and who collects
// metrics looks every few seconds.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "server/store/store.h"

namespace shapedb::catalog {

/// Thread-safe.
class RecentStats {
  public:
    /// `count` counts anew. Thread-safe.
    explicit RecentStats(std::function<Result<store::StoreStats>()> count) : count_(std::move(count)) {}

    /// The last ones, unless counting again would take less than a twentieth of the time since then. Errors:
    /// those of `count`.
    [[nodiscard]] Result<store::StoreStats> get() {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto began = Clock::now();
        if (last_ && began < validUntil_) return *last_;
        last_.reset();
        auto counted = count_();
        if (!counted) return counted;
        const auto ended = Clock::now();
        validUntil_ = ended + kShare * (ended - began);
        last_ = *counted;
        return counted;
    }

  private:
    using Clock = std::chrono::steady_clock;
    static constexpr int kShare = 20;

    std::function<Result<store::StoreStats>()> count_;
    std::mutex mutex_;
    std::optional<store::StoreStats> last_;
    Clock::time_point validUntil_{};
};

}  // namespace shapedb::catalog
