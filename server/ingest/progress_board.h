// SPDX-License-Identifier: GPL-3.0-or-later
// Progress of running segmentations, for callers that watch or wait.
//
// The board only tells that something changed; the state of a shape is in the store.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace shapedb::ingest {

/// Thread-safe. Must outlive its watches.
class ProgressBoard {
  public:
    using Clock = std::chrono::steady_clock;

    struct Status {
        std::string stage = "queued";  ///< or the name of the stage being run
        std::uint64_t done = 0;        ///< of total, in the stage's own unit
        std::uint64_t total = 0;       ///< 0: unknown
        std::uint64_t sequence = 0;    ///< rises with each change of this shape
    };

    /// Progress of a worker. Watchers are told of a new stage at once, of progress inside a stage at
    /// most every 50 ms. `stage` must be static.
    void report(std::int64_t shapeId, const char* stage, std::uint64_t done, std::uint64_t total);
    /// No worker has the shape any more, and its state in the store may have changed.
    void settled(std::int64_t shapeId);

    /// How many wait for a change of the shape now.
    [[nodiscard]] int waiting(std::int64_t shapeId) const;

    /// Watches one shape until destroyed.
    class Watch {
      public:
        ~Watch();
        Watch(const Watch&) = delete;
        Watch& operator=(const Watch&) = delete;

        [[nodiscard]] Status status() const;
        /// Returns as soon as the sequence differs from `seen`, or at `until`.
        void waitForChange(std::uint64_t seen, Clock::time_point until) const;

      private:
        friend class ProgressBoard;
        Watch(ProgressBoard& board, std::int64_t shapeId) : board_(board), shapeId_(shapeId) {}

        ProgressBoard& board_;
        std::int64_t shapeId_;
    };

    [[nodiscard]] std::unique_ptr<Watch> watch(std::int64_t shapeId);

  private:
    struct Entry {
        Status status;
        bool running = false;
        int watchers = 0;
        int waiting = 0;  ///< watchers inside `waitForChange`
        Clock::time_point announced{};
        std::condition_variable changed;
    };

    /// Removes the entry when neither a worker nor a watcher needs it. Under mutex_.
    void release(std::map<std::int64_t, std::unique_ptr<Entry>>::iterator entry);

    mutable std::mutex mutex_;
    std::map<std::int64_t, std::unique_ptr<Entry>> entries_;
};

}  // namespace shapedb::ingest
