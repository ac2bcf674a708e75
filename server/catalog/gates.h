// SPDX-License-Identifier: GPL-3.0-or-later
// Admission: which calls may enter, write, compute and hold memory.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <shared_mutex>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/limits.h"
#include "server/security/operation.h"

namespace shapedb::catalog {

/// Calls at a time, streams included.
struct CallCounts {
    int ordinary = 0;  ///< all but those of administrators; uploads among them
    int uploads = 0;
    int admin = 0;
    int longAdmin = 0;  ///< among them
};

/// Counts running calls, and admits none beyond the limits of its kind, so that one kind of call cannot
/// starve the others; once draining, admits no more. Thread-safe.
class CallGate {
  public:
    /// `limits`: the most that may run at a time.
    explicit CallGate(const CallCounts& limits) : limits_(limits) {}

    /// Call `leave` at the end of an admitted call. Errors: kUnavailable (draining), kQueueFull.
    [[nodiscard]] Result<void> enter(security::CallClass kind);
    void leave(security::CallClass kind);
    [[nodiscard]] CallCounts running();
    /// From now on `enter` fails.
    void drain();
    [[nodiscard]] bool draining() const { return draining_.load(); }
    /// Waits at most until `until`; true when no call is left.
    [[nodiscard]] bool waitUntilEmpty(std::chrono::steady_clock::time_point until);

  private:
    const CallCounts limits_;
    std::mutex mutex_;
    std::condition_variable changed_;
    CallCounts running_;
    std::atomic<bool> draining_{false};
};

/// Keeps writes apart from restores, which replace the whole database, and lets calls notice that one
/// happened. Thread-safe.
class RestoreGate {
  public:
    /// Held (shared) from looking up a collection until the write to it is done.
    class Write {
      public:
        explicit Write(RestoreGate& gate);

      private:
        std::shared_lock<std::shared_mutex> lock_;
    };

    /// Rises before and after content is replaced: ids are only valid within one epoch.
    [[nodiscard]] std::uint64_t epoch() const { return epoch_.load(); }

    /// Errors: kRejected (a restore is running).
    [[nodiscard]] Result<void> beginRestore();
    /// Excludes writes; between `beginRestore` and `endRestore`.
    [[nodiscard]] std::unique_lock<std::shared_mutex> exclusive() {
        return std::unique_lock<std::shared_mutex>(mutex_);
    }
    /// How many writes wait for a restore to end.
    [[nodiscard]] int waitingWrites() const { return waitingWrites_.load(); }
    /// Before the store may show other content than the index.
    void replacing() {
        apart_ = true;
        epoch_.fetch_add(1);
    }
    /// Once both hold the same content, be it the new or, after an error, the old.
    void replaced() {
        // First, so that a call that began in between notices at its end.
        epoch_.fetch_add(1);
        apart_ = false;
    }
    /// Between `replacing` and `replaced`: what is looked up now cannot be trusted.
    [[nodiscard]] bool apart() const { return apart_.load(); }
    void endRestore() { restoring_ = false; }
    /// Errors: kUnavailable (a restore is running).
    [[nodiscard]] Result<void> requireNoRestore() const;

  private:
    std::shared_mutex mutex_;
    std::atomic<std::uint64_t> epoch_{0};
    std::atomic<bool> restoring_{false};
    std::atomic<bool> apart_{false};
    std::atomic<int> waitingWrites_{0};
};

/// Limits how many segmentations run for callers at a time; the others wait. Thread-safe.
class SegmentationSlots {
  public:
    explicit SegmentationSlots(int slots) : free_(slots) {}

    /// After `acquire`, one slot until destroyed.
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

/// An amount that all calls may hold together. Thread-safe.
class Budget {
  public:
    /// `what` completes the message "all of the N ... are taken"; static storage.
    Budget(std::uint64_t total, const char* what) : total_(total), what_(what), free_(total) {}

    /// One call's share; returned when destroyed.
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

/// What every call of every transport passes or draws on.
struct Admission {
    /// `uploadBytes`, `uploadCalls`: config limits.max_upload_bytes and limits.max_uploads.
    Admission(std::uint64_t uploadBytes, int uploadCalls);

    CallGate calls;
    Budget uploads;    ///< bytes of points being received, or sent as they were received
    Budget followers;  ///< calls that wait for a shape or a rebuild
    Budget requests;   ///< bytes that large messages may become when they are decoded
    Budget answers;    ///< bytes of large answers, as encoded, until they are written
    Budget copies;     ///< copies of the database on their way to or from a client
};

/// How many bytes an answer may still grow by. One for each request, kept until the answer is written: a
/// client that does not read keeps it in memory. Thread-safe.
class AnswerRoom {
  public:
    /// `all`: what the answers of all calls may take together; must outlive this.
    explicit AnswerRoom(Budget& all) : share_(all) {}

    /// Errors: kInvalidArgument, saying how to ask for less; kQueueFull (the answers of other calls).
    [[nodiscard]] Result<void> take(std::size_t bytes);

  private:
    std::mutex mutex_;
    std::size_t left_ = kMaxAnswerBytes;
    Budget::Share share_;
};

}  // namespace shapedb::catalog
