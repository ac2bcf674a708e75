#include "server/rpc/cancel_watcher.h"

#include "server/catalog/limits.h"

namespace shapedb::rpc {

CancelWatcher::CancelWatcher(std::chrono::milliseconds stall) : stall_(stall), thread_([this] { run(); }) {}

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
            changed_.wait_for(lock, catalog::kLookForCancellation, [this] { return stopping_; });
        }
        for (Registration* call : calls_) look(*call);
    }
}

void CancelWatcher::look(Registration& call) const {
    if (call.flag_) return;
    if (call.context_.IsCancelled()) {
        call.flag_ = true;
        return;
    }
    const Clock::rep since = call.blockedSince_;
    if (since == 0 || Clock::now() - Clock::time_point(Clock::duration(since)) < stall_) return;
    call.stalled_ = true;
    call.context_.TryCancel();
}

CancelWatcher::Registration::Registration(CancelWatcher& watcher, grpc::ServerContext& context)
    : watcher_(watcher), context_(context) {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    watcher_.calls_.insert(this);
    if (watcher_.calls_.size() == 1) watcher_.changed_.notify_all();
}

CancelWatcher::Registration::~Registration() {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    watcher_.calls_.erase(this);
}

}  // namespace shapedb::rpc
