#include "server/ingest/crash_isolation.h"

namespace shapedb::ingest {

CrashIsolation::Pass::Pass(CrashIsolation& gate, bool suspect) : gate_(gate), suspect_(suspect) {
    std::unique_lock<std::mutex> lock(gate_.mutex_);
    if (!suspect_) {
        gate_.changed_.wait(lock, [this] { return !gate_.suspectInside_ && gate_.waitingSuspects_ == 0; });
        ++gate_.ordinary_;
        return;
    }
    ++gate_.waitingSuspects_;
    gate_.changed_.wait(lock, [this] { return !gate_.suspectInside_ && gate_.ordinary_ == 0; });
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

}  // namespace shapedb::ingest
