// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/crash_journal.h"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/store/failpoints.h"

namespace shapedb::ingest {

namespace {

constexpr const char* kFormat = "shapedb rebuild journal 2";

}  // namespace

CrashJournal::CrashJournal(std::string path, const std::vector<store::Crash>& crashes,
                           telemetry::LoggerPtr log)
    : path_(std::move(path)), log_(std::move(log)) {
    read(crashes);
}

/// A line with the version of the format, then lines `shape-id points-version crashes stops in-hand`; reading
/// ends at anything else: better to try a scan again than to trust a damaged count.
void CrashJournal::read(const std::vector<store::Crash>& crashes) {
    std::ifstream file(path_);
    std::string format;
    if (!std::getline(file, format) || format != kFormat) return;
    std::int64_t id = 0;
    std::int64_t version = 0;
    store::Deaths deaths;
    int inHand = 0;
    while (file >> id >> version >> deaths.crashes >> deaths.stops >> inHand) {
        if (inHand != 0) ++(store::crashed(crashes, id, version) ? deaths.crashes : deaths.stops);
        states_[{id, version}].deaths = deaths;
    }
}

/// Under mutex_. Renamed into place, so that a death in between leaves the old file whole. Not synced, since
/// a crash of the machine is no scan's fault.
void CrashJournal::write() {
    if (path_.empty()) return;
    std::ostringstream lines;
    lines << kFormat << '\n';
    for (const auto& [key, state] : states_) {
        lines << key.first << ' ' << key.second << ' ' << state.deaths.crashes << ' ' << state.deaths.stops
              << ' ' << state.inHand << '\n';
    }
    const std::string text = lines.str();
    const std::string next = path_ + ".new";
    // Private to its owner, and not through a link.
    const int file =
        ::open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
    const bool written =
        file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    if (file >= 0) ::close(file);
    SHAPEDB_FAILPOINT("journal.written");
    if (!written || std::rename(next.c_str(), path_.c_str()) != 0) {
        log_->warn("crash journal of the rebuild cannot be written", {{"path", path_}});
    }
}

store::Deaths CrashJournal::deaths(const store::Shape& shape) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = states_.find({shape.id, shape.pointsVersion});
    return found == states_.end() ? store::Deaths() : found->second.deaths;
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
    SHAPEDB_FAILPOINT("journal.in_hand");
}

CrashJournal::Entry::~Entry() {
    const std::lock_guard<std::mutex> lock(journal_.mutex_);
    State& state = journal_.states_[key_];
    state.inHand = false;
    // A scan with deaths stays on record until it is acquitted.
    if (acquitted_ || !store::isSuspect(state.deaths)) journal_.states_.erase(key_);
    journal_.write();
}

}  // namespace shapedb::ingest
