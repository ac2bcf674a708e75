// What calls share besides data: who may enter, who may write, who may compute.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <shared_mutex>

#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::rpc {

/// Counts running calls and, once draining, lets no more in. Thread-safe.
class CallGate {
  public:
    /// False when draining; otherwise `leave` must follow.
    [[nodiscard]] bool enter();
    void leave();
    /// From now on `enter` refuses.
    void drain();
    [[nodiscard]] bool draining() const { return draining_.load(); }
    /// True when no call is left at `until` at the latest.
    [[nodiscard]] bool waitUntilEmpty(std::chrono::steady_clock::time_point until);

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    int calls_ = 0;
    std::atomic<bool> draining_{false};
};

/// Keeps writes and the replacement of the whole database (restore) apart, and tells calls
/// that span one. Thread-safe.
class RestoreGate {
  public:
    /// Held shared around "look up a collection, write to it".
    class Write {
      public:
        explicit Write(RestoreGate& gate) : lock_(gate.mutex_) {}

      private:
        std::shared_lock<std::shared_mutex> lock_;
    };

    /// Raised by each restore: ids read under one epoch mean nothing under another.
    [[nodiscard]] std::uint64_t epoch() const { return epoch_.load(); }

    /// Errors: kRejected (a restore is running).
    [[nodiscard]] Result<void> beginRestore();
    /// The exclusive part; between `beginRestore` and `endRestore`.
    [[nodiscard]] std::unique_lock<std::shared_mutex> exclusive() {
        return std::unique_lock<std::shared_mutex>(mutex_);
    }
    void replaced() { epoch_.fetch_add(1); }
    void endRestore() { restoring_ = false; }
    [[nodiscard]] bool restoring() const { return restoring_.load(); }

  private:
    std::shared_mutex mutex_;
    std::atomic<std::uint64_t> epoch_{0};
    std::atomic<bool> restoring_{false};
};

/// At most so many segmentations for callers at one moment; the others wait their turn.
/// Thread-safe.
class SegmentationSlots {
  public:
    explicit SegmentationSlots(int slots) : free_(slots) {}

    /// Until destroyed, one slot is taken (if `acquire` succeeded).
    class Slot {
      public:
        explicit Slot(SegmentationSlots& slots) : slots_(slots) {}
        ~Slot();
        Slot(const Slot&) = delete;
        Slot& operator=(const Slot&) = delete;
        /// Waits. Errors: kCancelled, kDeadlineExceeded.
        [[nodiscard]] Result<void> acquire(const RunContext& context);

      private:
        SegmentationSlots& slots_;
        bool taken_ = false;
    };

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    int free_;
};

/// So much of something that all calls may hold together. Thread-safe.
class Budget {
  public:
    /// `what` completes "all of the N ...": static, e.g. "bytes that uploads may hold".
    Budget(std::uint64_t total, const char* what) : total_(total), what_(what), free_(total) {}

    /// One call's share; given back when destroyed.
    class Share {
      public:
        explicit Share(Budget& budget) : budget_(budget) {}
        ~Share() { budget_.free_.fetch_add(taken_); }
        Share(const Share&) = delete;
        Share& operator=(const Share&) = delete;
        /// Errors: kQueueFull.
        [[nodiscard]] Result<void> take(std::uint64_t amount);

      private:
        Budget& budget_;
        std::uint64_t taken_ = 0;
    };

  private:
    const std::uint64_t total_;
    const char* const what_;
    std::atomic<std::uint64_t> free_;
};

}  // namespace shapedb::rpc
