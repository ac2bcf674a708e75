// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/cancel_watcher.h"

#include <string>
#include <utility>

#include <grpc/grpc.h>

#include "common/protocol.h"
#include "server/catalog/limits.h"
#include "server/rpc/status.h"

namespace shapedb::rpc {
namespace {

constexpr std::chrono::seconds kToSayItBetter{1};

}  // namespace

CancelWatcher::CancelWatcher(std::chrono::milliseconds stall, std::uint64_t leastRate)
    : limits_{stall, leastRate}, thread_([this] { run(); }) {}

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
    if (const auto still = call.stillAllowed_ ? call.stillAllowed_() : Result<void>(); !still) {
        if (!call.refusedSince_) call.refusedSince_ = Clock::now();
        if (Clock::now() - *call.refusedSince_ >= kToSayItBetter) cutOff(call, still.error());
    }
    const Clock::rep since = call.blockedSince_;
    if (since == 0) return;
    const auto now = Clock::now() - Clock::time_point(Clock::duration(since));
    const net::Pace pace = net::paceOf(limits_, now, now + Clock::duration(call.blocked_), call.bytes_);
    if (pace != net::Pace::kGood) cutOff(call, {ErrorCode::kDeadlineExceeded, net::reasonOf(pace, limits_)});
}

// A handler that is blocked in a read or write can only be freed by cancelling the call, and then has no say
// in its status. What ServerContext::TryCancel does, a bare CANCELLED, is this call with that code: of a
// server's call gRPC sends the client the code and the message it is cancelled with, if no status was sent
// before.
void CancelWatcher::cutOff(Registration& call, const Error& why) {
    if (call.cutOff_) return;
    call.cutOff_ = withContext(why, kCutOffPrefix);
    grpc_call_cancel_with_status(call.context_.c_call(),
                                 static_cast<grpc_status_code>(statusCodeOf(why.code)),
                                 call.cutOff_->message.c_str(), nullptr);
}

void CancelWatcher::cutOffAll(const Error& why) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (Registration* call : calls_) cutOff(*call, why);
}

void CancelWatcher::Registration::guard(std::function<Result<void>()> stillAllowed) {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    stillAllowed_ = std::move(stillAllowed);
}

std::optional<Error> CancelWatcher::Registration::end() {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    watcher_.calls_.erase(this);
    return cutOff_;
}

CancelWatcher::Registration::Registration(CancelWatcher& watcher, grpc::ServerContext& context)
    : watcher_(watcher), context_(context) {
    join();
}

void CancelWatcher::Registration::join() {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    watcher_.calls_.insert(this);
    if (watcher_.calls_.size() == 1) watcher_.changed_.notify_all();
}

void CancelWatcher::Registration::beginAnswer(std::size_t bytes) {
    const auto chunks = static_cast<std::int64_t>(bytes / catalog::kMaxChunkBytes);
    blocked_ = 0;
    bytes_ = 0;
    blockedSince_ = (Clock::now() + chunks * watcher_.limits_.stall).time_since_epoch().count();
    join();
}

CancelWatcher::Registration::~Registration() {
    const std::lock_guard<std::mutex> lock(watcher_.mutex_);
    watcher_.calls_.erase(this);
}

}  // namespace shapedb::rpc
