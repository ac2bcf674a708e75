// SPDX-License-Identifier: GPL-3.0-or-later
// Turns gRPC's "is this call cancelled?" into a flag for long-running work, and cuts off clients that
// send or read nothing, or hardly anything: each holds a thread. Their status says why.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include <grpcpp/server_context.h>

#include "core/base/error.h"
#include "server/net/transfer_pace.h"

namespace shapedb::rpc {

/// One thread polls gRPC for all running calls (kLookForCancellation), so that core/ only checks a flag
/// and knows nothing of gRPC.
///
/// Thread-safe. Must outlive its registrations.
class CancelWatcher {
  public:
    using Clock = std::chrono::steady_clock;

    /// Cuts off calls that are blocked in reads or writes for longer than net::paceOf allows, with the status
    /// of kDeadlineExceeded.
    CancelWatcher(std::chrono::milliseconds stall, std::uint64_t leastRate);
    ~CancelWatcher();
    CancelWatcher(const CancelWatcher&) = delete;
    CancelWatcher& operator=(const CancelWatcher&) = delete;

    /// Cuts off all calls that are running now, with the status of `why`.
    void cutOffAll(const Error& why);

    /// One running call; `context` must outlive this.
    class Registration {
      public:
        Registration(CancelWatcher& watcher, grpc::ServerContext& context);
        ~Registration();
        Registration(const Registration&) = delete;
        Registration& operator=(const Registration&) = delete;

        /// The call is cut off, with the status of the error, a second after `stillAllowed` fails: so that
        /// the handler can report the reason itself. It is called often, by another thread.
        void guard(std::function<Result<void>()> stillAllowed);

        /// True once the client has gone or cancelled, or the deadline has passed.
        [[nodiscard]] const std::atomic<bool>& flag() const { return flag_; }

        /// Called before and after each read or write of a stream.
        void beginTransfer() { blockedSince_ = Clock::now().time_since_epoch().count(); }
        void endTransfer(std::size_t bytes) {
            blocked_ += Clock::now().time_since_epoch().count() - blockedSince_.exchange(0);
            bytes_ += bytes;
        }
        /// Once the outcome of the call is known: it is not cut off any more, or a client would be told so of
        /// what was done. Why it was cut off before, if it was: what its client has been told.
        [[nodiscard]] std::optional<Error> end();
        /// After `end`, before an answer of so many bytes is written at once: from now on the call is cut off
        /// again. For each chunk of it (kMaxChunkBytes) the client may be silent as long as for one message.
        void beginAnswer(std::size_t bytes);

      private:
        friend class CancelWatcher;
        void join();

        CancelWatcher& watcher_;
        grpc::ServerContext& context_;
        std::atomic<bool> flag_{false};
        std::optional<Error> cutOff_;                 ///< guarded by the watcher's mutex, as is the next
        std::function<Result<void>()> stillAllowed_;  ///< may be empty
        std::optional<Clock::time_point> refusedSince_;
        std::atomic<Clock::rep> blockedSince_{0};  ///< 0: not blocked
        std::atomic<Clock::rep> blocked_{0};       ///< in earlier transfers
        std::atomic<std::uint64_t> bytes_{0};      ///< moved so far
    };

  private:
    void run();
    void look(Registration& call) const;
    static void cutOff(Registration& call, const Error& why);

    const net::PaceLimits limits_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::set<Registration*> calls_;
    bool stopping_ = false;
    std::thread thread_;
};

}  // namespace shapedb::rpc
