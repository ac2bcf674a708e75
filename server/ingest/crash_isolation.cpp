// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/crash_isolation.h"

#include <chrono>

namespace shapedb::ingest {

namespace {

/// How often a waiting thread checks for cancellation.
constexpr std::chrono::milliseconds kLookForCancel{20};

}  // namespace

CrashIsolation::Pass::Pass(CrashIsolation& gate, bool suspect, const std::atomic<bool>& cancel)
    : gate_(gate), suspect_(suspect) {
    std::unique_lock<std::mutex> lock(gate_.mutex_);
    if (!suspect_) {
        ++gate_.waitingOrdinary_;
        admitted_ = gate_.waitUntilOpen(lock, false, cancel);
        --gate_.waitingOrdinary_;
        if (admitted_) ++gate_.ordinary_;
        return;
    }
    ++gate_.waitingSuspects_;
    admitted_ = gate_.waitUntilOpen(lock, true, cancel);
    --gate_.waitingSuspects_;
    if (admitted_) {
        gate_.suspectInside_ = true;
    } else {
        gate_.changed_.notify_all();  // it kept ordinary scans out
    }
}

CrashIsolation::Pass::~Pass() {
    if (!admitted_) return;
    const std::lock_guard<std::mutex> lock(gate_.mutex_);
    if (suspect_) {
        gate_.suspectInside_ = false;
    } else {
        --gate_.ordinary_;
    }
    gate_.changed_.notify_all();
}

/// False when cancelled.
bool CrashIsolation::waitUntilOpen(std::unique_lock<std::mutex>& lock, bool suspect,
                                   const std::atomic<bool>& cancel) {
    while (!cancel) {
        if (changed_.wait_for(lock, kLookForCancel, [&] { return isOpen(suspect); })) return true;
    }
    return false;
}

bool CrashIsolation::wouldWait(bool suspect) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !isOpen(suspect);
}

int CrashIsolation::waiting() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return waitingSuspects_ + waitingOrdinary_;
}

bool CrashIsolation::isOpen(bool suspect) const {
    return !suspectInside_ && (suspect ? ordinary_ : waitingSuspects_) == 0;
}

}  // namespace shapedb::ingest
