// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/progress_board.h"

namespace shapedb::ingest {
namespace {

/// Between two notifications inside a stage.
constexpr std::chrono::milliseconds kQuiet{50};

}  // namespace

void ProgressBoard::report(std::int64_t shapeId, const char* stage, std::uint64_t done, std::uint64_t total) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::unique_ptr<Entry>& entry = entries_[shapeId];
    if (!entry) entry = std::make_unique<Entry>();
    const Clock::time_point now = Clock::now();
    const bool newStage = !entry->running || entry->status.stage != stage;
    entry->running = true;
    entry->status.stage = stage;
    entry->status.done = done;
    entry->status.total = total;
    if (!newStage && now - entry->announced < kQuiet) return;
    entry->announced = now;
    ++entry->status.sequence;
    entry->changed.notify_all();
}

void ProgressBoard::settled(std::int64_t shapeId) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = entries_.find(shapeId);
    if (found == entries_.end()) return;
    Entry& entry = *found->second;
    entry.running = false;
    // The sequence goes on: watchers compare it with the last one they saw.
    const std::uint64_t sequence = entry.status.sequence + 1;
    entry.status = Status();
    entry.status.sequence = sequence;
    entry.changed.notify_all();
    release(found);
}

int ProgressBoard::waiting(std::int64_t shapeId) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = entries_.find(shapeId);
    return found == entries_.end() ? 0 : found->second->waiting;
}

std::unique_ptr<ProgressBoard::Watch> ProgressBoard::watch(std::int64_t shapeId) {
    std::unique_ptr<Watch> watch(new Watch(*this, shapeId));
    const std::lock_guard<std::mutex> lock(mutex_);
    std::unique_ptr<Entry>& entry = entries_[shapeId];
    if (!entry) entry = std::make_unique<Entry>();
    ++entry->watchers;
    return watch;
}

void ProgressBoard::release(std::map<std::int64_t, std::unique_ptr<Entry>>::iterator entry) {
    if (!entry->second->running && entry->second->watchers == 0) entries_.erase(entry);
}

ProgressBoard::Watch::~Watch() {
    const std::lock_guard<std::mutex> lock(board_.mutex_);
    const auto found = board_.entries_.find(shapeId_);
    --found->second->watchers;
    board_.release(found);
}

ProgressBoard::Status ProgressBoard::Watch::status() const {
    const std::lock_guard<std::mutex> lock(board_.mutex_);
    return board_.entries_.at(shapeId_)->status;
}

void ProgressBoard::Watch::waitForChange(std::uint64_t seen, Clock::time_point until) const {
    std::unique_lock<std::mutex> lock(board_.mutex_);
    Entry& entry = *board_.entries_.at(shapeId_);
    ++entry.waiting;
    entry.changed.wait_until(lock, until, [&] { return entry.status.sequence != seen; });
    --entry.waiting;
}

}  // namespace shapedb::ingest
