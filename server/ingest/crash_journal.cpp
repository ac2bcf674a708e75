#include "server/ingest/crash_journal.h"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <system_error>

namespace shapedb::ingest {

CrashJournal::CrashJournal(std::string path, telemetry::LoggerPtr log)
    : path_(std::move(path)), log_(std::move(log)) {
    read();
}

/// Lines `shape-id points-version deaths in-hand`; reading ends at anything else: better to try a
/// scan again than to trust a damaged count.
void CrashJournal::read() {
    std::ifstream file(path_);
    std::int64_t id = 0;
    std::int64_t version = 0;
    int deaths = 0;
    int inHand = 0;
    while (file >> id >> version >> deaths >> inHand) states_[{id, version}].deaths = deaths + inHand;
}

/// Under mutex_. Renamed into place, so that a death in between leaves the old file whole. Not synced, since
/// a crash of the machine is no scan's fault.
void CrashJournal::write() {
    if (path_.empty()) return;
    std::ostringstream text;
    for (const auto& [key, state] : states_) {
        text << key.first << ' ' << key.second << ' ' << state.deaths << ' ' << state.inHand << '\n';
    }
    const std::string next = path_ + ".new";
    std::ofstream file(next, std::ios::trunc);
    file << text.str();
    file.close();
    if (!file || std::rename(next.c_str(), path_.c_str()) != 0) {
        log_->warn("crash journal of the rebuild cannot be written", {{"path", path_}});
    }
}

int CrashJournal::deaths(const store::Shape& shape) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = states_.find({shape.id, shape.pointsVersion});
    return found == states_.end() ? 0 : found->second.deaths;
}

void CrashJournal::clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    states_.clear();
    write();
}

CrashJournal::Entry::Entry(CrashJournal& journal, const store::Shape& shape)
    : journal_(journal), key_(shape.id, shape.pointsVersion) {
    const std::lock_guard<std::mutex> lock(journal_.mutex_);
    journal_.states_[key_].inHand = true;
    journal_.write();
}

CrashJournal::Entry::~Entry() {
    const std::lock_guard<std::mutex> lock(journal_.mutex_);
    State& state = journal_.states_[key_];
    state.inHand = false;
    // A scan with deaths stays on record until it is acquitted.
    if (acquitted_ || state.deaths == 0) journal_.states_.erase(key_);
    journal_.write();
}

}  // namespace shapedb::ingest
