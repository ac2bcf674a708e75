#include "server/ingest/crash_isolation.h"

namespace shapedb::ingest {

CrashIsolation::Pass::Pass(CrashIsolation& gate, bool suspect) : gate_(gate), suspect_(suspect) {
    std::unique_lock<std::mutex> lock(gate_.mutex_);
    if (!suspect_) {
        gate_.changed_.wait(lock, [this] { return gate_.isOpen(false); });
        ++gate_.ordinary_;
        return;
    }
    ++gate_.waitingSuspects_;
    gate_.changed_.wait(lock, [this] { return gate_.isOpen(true); });
    --gate_.waitingSuspects_;
    gate_.suspectInside_ = true;
}

CrashIsolation::Pass::~Pass() {
    const std::lock_guard<std::mutex> lock(gate_.mutex_);
    if (suspect_) {
        gate_.suspectInside_ = false;
    } else {
        --gate_.ordinary_;
    }
    gate_.changed_.notify_all();
}

bool CrashIsolation::wouldWait(bool suspect) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !isOpen(suspect);
}

bool CrashIsolation::isOpen(bool suspect) const {
    return !suspectInside_ && (suspect ? ordinary_ : waitingSuspects_) == 0;
}

}  // namespace shapedb::ingest
