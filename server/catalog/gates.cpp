// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/gates.h"

#include <string>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"

namespace shapedb::catalog {

namespace {

bool isAdmin(security::CallClass kind) {
    return kind == security::CallClass::kAdmin || kind == security::CallClass::kAdminLong;
}

}  // namespace

Result<void> CallGate::enter(security::CallClass kind) {
    const auto full = [](const char* what, int limit) {
        return fail(ErrorCode::kQueueFull, "all of the " + std::to_string(limit) + " places for " + what +
                                               " are taken: try again later");
    };
    const std::lock_guard<std::mutex> lock(mutex_);
    if (draining_) return fail(ErrorCode::kUnavailable, "the server is shutting down: try again later");
    if (isAdmin(kind)) {
        const bool lasts = kind == security::CallClass::kAdminLong;
        if (running_.admin >= limits_.admin) return full("calls of administrators", limits_.admin);
        if (lasts && running_.longAdmin >= limits_.longAdmin) {
            return full("rebuilds, checks and copies", limits_.longAdmin);
        }
        ++running_.admin;
        if (lasts) ++running_.longAdmin;
        return {};
    }
    if (running_.ordinary >= limits_.ordinary) return full("calls", limits_.ordinary);
    if (kind == security::CallClass::kUpload) {
        if (running_.uploads >= limits_.uploads) return full("uploads (limits.max_uploads)", limits_.uploads);
        ++running_.uploads;
    }
    ++running_.ordinary;
    return {};
}

void CallGate::leave(security::CallClass kind) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kind == security::CallClass::kUpload) --running_.uploads;
    if (kind == security::CallClass::kAdminLong) --running_.longAdmin;
    --(isAdmin(kind) ? running_.admin : running_.ordinary);
    if (running_.ordinary + running_.admin == 0) changed_.notify_all();
}

CallCounts CallGate::running() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return running_;
}

void CallGate::drain() {
    const std::lock_guard<std::mutex> lock(mutex_);
    draining_ = true;
}

bool CallGate::waitUntilEmpty(std::chrono::steady_clock::time_point until) {
    std::unique_lock<std::mutex> lock(mutex_);
    return changed_.wait_until(lock, until, [this] { return running_.ordinary + running_.admin == 0; });
}

RestoreGate::Write::Write(RestoreGate& gate) : lock_(gate.mutex_, std::try_to_lock) {
    if (lock_) return;
    gate.waitingWrites_.fetch_add(1);
    lock_.lock();
    gate.waitingWrites_.fetch_sub(1);
}

Result<void> RestoreGate::beginRestore() {
    if (restoring_.exchange(true)) {
        return fail(ErrorCode::kRejected, "another restore is running: wait until it is done");
    }
    return {};
}

Result<void> RestoreGate::requireNoRestore() const {
    if (!restoring_.load()) return {};
    return fail(ErrorCode::kUnavailable, "the database is being replaced by a backup: try again later");
}

SegmentationSlots::Slot::~Slot() {
    if (!taken_) return;
    const std::lock_guard<std::mutex> lock(slots_.mutex_);
    ++slots_.free_;
    slots_.changed_.notify_one();
}

Result<void> SegmentationSlots::Slot::acquire(const RunContext& context) {
    std::unique_lock<std::mutex> lock(slots_.mutex_);
    while (slots_.free_ == 0) {
        RETURN_IF_ERROR(context.checkpoint());
        slots_.changed_.wait_for(lock, kLookForCancellation);
    }
    --slots_.free_;
    taken_ = true;
    return {};
}

Result<void> Budget::Share::take(std::uint64_t amount) {
    std::uint64_t free = budget_.free_.load();
    do {
        if (free < amount) {
            return fail(ErrorCode::kQueueFull, "all of the " + std::to_string(budget_.total_) + " " +
                                                   budget_.what_ + " are taken: try again later");
        }
    } while (!budget_.free_.compare_exchange_weak(free, free - amount));
    taken_ += amount;
    return {};
}

Admission::Admission(std::uint64_t uploadBytes, int uploadCalls)
    : calls({kMaxOrdinaryCalls, uploadCalls, kMaxAdminCalls, kMaxLongAdminCalls}),
      uploads(uploadBytes, "bytes of points that uploads in progress may hold (limits.max_upload_bytes)"),
      followers(kMaxFollowers, "calls that may wait for shapes and rebuilds"),
      requests(kMaxRequestsBytes, "bytes of memory for decoding large messages"),
      answers(kMaxAnswersBytes, "bytes that large answers may take together"),
      copies(kMaxCopies, "places for a backup or restore in transit") {}

Result<void> AnswerRoom::take(std::size_t bytes) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (bytes > left_) {
        return fail(ErrorCode::kInvalidArgument,
                    "the answer would exceed " + std::to_string(kMaxAnswerBytes) +
                        " bytes; ask for fewer shapes, hits or queries, or for no explanations");
    }
    RETURN_IF_ERROR(share_.take(bytes));
    left_ -= bytes;
    return {};
}

}  // namespace shapedb::catalog
