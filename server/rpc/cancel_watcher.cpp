#include "server/rpc/cancel_watcher.h"

#include "server/rpc/limits.h"

namespace shapedb::rpc {

CancelWatcher::CancelWatcher() : thread_([this] { run(); }) {}

CancelWatcher::~CancelWatcher() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stopping_ = true;
        changed_.notify_all();
    }
    thread_.join();
}

void CancelWatcher::run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopping_) {
        if (calls_.empty()) {
            changed_.wait(lock, [this] { return stopping_ || !calls_.empty(); });
        } else {
            changed_.wait_for(lock, kLookForCancellation, [this] { return stopping_; });
        }
        for (const auto& [flag, context] : calls_) {
            if (!flag->load(std::memory_order_relaxed) && context->IsCancelled()) *flag = true;
        }
    }
}

CancelWatcher::Registration::Registration(CancelWatcher& watcher, const grpc::ServerContext& context)
    : watcher_(watcher) {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    const bool wasEmpty = watcher_.calls_.empty();
    watcher_.calls_[&flag_] = &context;
    if (wasEmpty) watcher_.changed_.notify_all();
}

CancelWatcher::Registration::~Registration() {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    watcher_.calls_.erase(&flag_);
}

}  // namespace shapedb::rpc
