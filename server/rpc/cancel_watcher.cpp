#include "server/rpc/cancel_watcher.h"

#include "server/catalog/limits.h"

namespace shapedb::rpc {

CancelWatcher::CancelWatcher(std::chrono::milliseconds stall, std::uint64_t leastRate)
    : stall_(stall), leastRate_(leastRate), thread_([this] { run(); }) {}

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
    if (since == 0) return;
    const auto now = Clock::now() - Clock::time_point(Clock::duration(since));
    const auto altogether = now + Clock::duration(call.blocked_);
    const std::chrono::duration<double> beyond = altogether - stall_;
    if (now >= stall_) {
        call.stalled_ = true;
    } else if (beyond.count() * static_cast<double>(leastRate_) > static_cast<double>(call.bytes_)) {
        call.tooSlow_ = true;
    } else {
        return;
    }
    call.context_.TryCancel();
}

std::optional<std::string> CancelWatcher::Registration::cutOff() const {
    if (stalled_) {
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(watcher_.stall_);
        return "the client neither sent nor read anything for " + std::to_string(seconds.count()) +
               " seconds";
    }
    if (tooSlow_) {
        return "the client sent or read less than " + std::to_string(watcher_.leastRate_) +
               " bytes per second";
    }
    return std::nullopt;
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
