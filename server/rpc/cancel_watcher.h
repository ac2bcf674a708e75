// Turns gRPC's "is this call cancelled?" into the flag that long-running work looks at, and
// cuts calls whose client neither sends nor takes anything.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include <grpcpp/server_context.h>

namespace shapedb::rpc {

/// One thread asks gRPC about all running calls in turn (kLookForCancellation): work deep
/// inside core/ checks a flag and knows nothing of gRPC.
///
/// Thread-safe. Must outlive its registrations.
class CancelWatcher {
  public:
    using Clock = std::chrono::steady_clock;

    /// A call blocked in a read or write for longer than `stall` is cancelled.
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

        /// True once the client has gone, cancelled, or passed its deadline.
        [[nodiscard]] const std::atomic<bool>& flag() const { return flag_; }

        /// Between these the call is blocked in a read or write of its stream.
        void beginTransfer() { blockedSince_ = Clock::now().time_since_epoch().count(); }
        void endTransfer() { blockedSince_ = 0; }
        /// True when the call was cut because nothing moved.
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
