// Turns gRPC's "is this call cancelled?" into a flag for long-running work, and cuts off clients that
// neither send nor read anything.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include <grpcpp/server_context.h>

namespace shapedb::rpc {

/// One thread polls gRPC for all running calls (kLookForCancellation), so that core/ only checks a flag
/// and knows nothing of gRPC.
///
/// Thread-safe. Must outlive its registrations.
class CancelWatcher {
  public:
    using Clock = std::chrono::steady_clock;

    /// Cancels calls that are blocked in a read or write for longer than `stall`.
    explicit CancelWatcher(std::chrono::milliseconds stall);
    ~CancelWatcher();
    CancelWatcher(const CancelWatcher&) = delete;
    CancelWatcher& operator=(const CancelWatcher&) = delete;

    /// One running call; `context` must outlive this.
    class Registration {
      public:
        Registration(CancelWatcher& watcher, grpc::ServerContext& context);
        ~Registration();
        Registration(const Registration&) = delete;
        Registration& operator=(const Registration&) = delete;

        /// True once the client has gone or cancelled, or the deadline has passed.
        [[nodiscard]] const std::atomic<bool>& flag() const { return flag_; }

        /// Called before and after each read or write of a stream.
        void beginTransfer() { blockedSince_ = Clock::now().time_since_epoch().count(); }
        void endTransfer() { blockedSince_ = 0; }
        /// True when the call was cancelled for being blocked too long.
        [[nodiscard]] bool stalled() const { return stalled_; }

      private:
        friend class CancelWatcher;

        CancelWatcher& watcher_;
        grpc::ServerContext& context_;
        std::atomic<bool> flag_{false};
        std::atomic<bool> stalled_{false};
        std::atomic<Clock::rep> blockedSince_{0};  ///< 0: not blocked
    };

  private:
    void run();
    void look(Registration& call) const;

    const std::chrono::milliseconds stall_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::set<Registration*> calls_;
    bool stopping_ = false;
    std::thread thread_;
};

}  // namespace shapedb::rpc
