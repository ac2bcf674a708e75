// SPDX-License-Identifier: GPL-3.0-or-later
// When a client that sends or reads too slowly is cut off: one rule for all transports.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace shapedb::net {

struct PaceLimits {
    std::chrono::milliseconds stall{};  ///< limits.stall_seconds
    std::uint64_t leastRate = 0;        ///< limits.min_bytes_per_second; 0: any
};

enum class Pace { kGood, kStalled, kTooSlow };

/// Judges a transfer that has waited for `now` this time, for `altogether` in total (that included), and has
/// moved `bytes`: it may be silent for `stall` at a time, and needs `leastRate` bytes for each second of
/// waiting, not counting the first `stall`.
template <typename Duration>
Pace paceOf(const PaceLimits& limits, Duration now, Duration altogether, std::uint64_t bytes) {
    const std::chrono::duration<double> beyond = altogether - limits.stall;
    if (now >= limits.stall) return Pace::kStalled;
    const bool slow = beyond.count() * static_cast<double>(limits.leastRate) > static_cast<double>(bytes);
    return slow ? Pace::kTooSlow : Pace::kGood;
}

/// "the client neither sent nor read anything for 60 seconds", and so on. `pace` is not kGood.
[[nodiscard]] inline std::string reasonOf(Pace pace, const PaceLimits& limits) {
    if (pace == Pace::kStalled) {
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limits.stall);
        return "the client neither sent nor read anything for " + std::to_string(seconds.count()) +
               " seconds (limits.stall_seconds)";
    }
    return "the client sent or read less than " + std::to_string(limits.leastRate) +
           " bytes per second (limits.min_bytes_per_second)";
}

/// Measures the waiting of one direction of a connection. Used by one thread.
class PaceMeter {
  public:
    using Clock = std::chrono::steady_clock;

    void begin(Clock::time_point now) {
        if (!since_) since_ = now;
    }
    void end(Clock::time_point now, std::uint64_t bytes) {
        if (since_) before_ += now - *since_;
        since_.reset();
        bytes_ += bytes;
    }
    [[nodiscard]] Pace pace(const PaceLimits& limits, Clock::time_point now) const {
        if (!since_) return Pace::kGood;
        return paceOf(limits, now - *since_, now - *since_ + before_, bytes_);
    }

  private:
    std::optional<Clock::time_point> since_;
    Clock::duration before_{};
    std::uint64_t bytes_ = 0;
};

}  // namespace shapedb::net
