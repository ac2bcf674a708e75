// Turns gRPC's "is this call cancelled?" into the flag that long-running work looks at.
#pragma once

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include <grpcpp/server_context.h>

namespace shapedb::rpc {

/// One thread asks gRPC about all running calls in turn (kLookForCancellation): work deep
/// inside core/ checks a flag and knows nothing of gRPC.
///
/// Thread-safe. Must outlive its registrations.
class CancelWatcher {
  public:
    CancelWatcher();
    ~CancelWatcher();
    CancelWatcher(const CancelWatcher&) = delete;
    CancelWatcher& operator=(const CancelWatcher&) = delete;

    /// One running call; `context` must outlive this.
    class Registration {
      public:
        Registration(CancelWatcher& watcher, const grpc::ServerContext& context);
        ~Registration();
        Registration(const Registration&) = delete;
        Registration& operator=(const Registration&) = delete;

        /// True once the client has gone, cancelled, or passed its deadline.
        [[nodiscard]] const std::atomic<bool>& flag() const { return flag_; }

      private:
        CancelWatcher& watcher_;
        std::atomic<bool> flag_{false};
    };

  private:
    void run();

    std::mutex mutex_;
    std::condition_variable changed_;
    std::map<std::atomic<bool>*, const grpc::ServerContext*> calls_;
    bool stopping_ = false;
    std::thread thread_;
};

}  // namespace shapedb::rpc
