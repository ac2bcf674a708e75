// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/change_follower.h"

#include <set>
#include <vector>

#include "core/base/return_if_error.h"

namespace shapedb::catalog {

namespace {

constexpr std::chrono::milliseconds kPause{200};
/// Entries that are applied together.
constexpr std::size_t kChangesAtATime = 1'000;

/// Whether `changes` go on where `known` ends, and each is of one shape.
bool isContinuous(const std::vector<store::Change>& changes, std::int64_t known) {
    for (const store::Change& change : changes) {
        if (change.number != ++known || !change.shapeId) return false;
    }
    return !changes.empty();
}

}  // namespace

Result<void> ChangeFollower::begin() {
    const std::lock_guard<std::mutex> lock(pass_);
    const auto logs = parts_.store.changeLogs();
    RETURN_IF_ERROR(logs);
    directory_ = logs->directory;
    known_ = logs->last;
    return {};
}

void ChangeFollower::start() {
    thread_ = std::thread([this] { run(); });
}

void ChangeFollower::stop() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stop_ = true;
    }
    stopped_.notify_one();
    if (thread_.joinable()) thread_.join();
}

void ChangeFollower::run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopped_.wait_for(lock, kPause, [this] { return stop_; })) {
        lock.unlock();
        const auto followed = follow();
        // Told once for each time that it stops working.
        if (!followed && following_) {
            parts_.log->error("changes of other servers cannot be read: searches may miss them",
                              telemetry::fieldsOf(followed.error()));
        }
        if (followed && !following_) parts_.log->info("changes of other servers are read again");
        following_ = followed.has_value();
        lock.lock();
    }
}

Result<void> ChangeFollower::follow() {
    const RestoreGate::Write notDuringARestore(parts_.restores);
    const std::lock_guard<std::mutex> lock(pass_);
    const auto logs = parts_.store.changeLogs();
    RETURN_IF_ERROR(logs);
    if (logs->directory != directory_) {
        // Those that are loaded now have all changes up to here at least. What this server has made itself
        // may lack those of others, from the first one on.
        for (const auto& [id, last] : logs->last) known_.emplace(id, parts_.index.byId(id) ? 0 : last);
        RETURN_IF_ERROR(followDirectory());
        directory_ = logs->directory;
    }
    for (const auto& [id, last] : logs->last) RETURN_IF_ERROR(followCollection(id, last));
    parts_.wake();
    return {};
}

Result<void> ChangeFollower::followTo(std::int64_t collectionId, std::int64_t number) {
    const auto isKnown = [&] {
        const std::lock_guard<std::mutex> lock(pass_);
        const auto known = known_.find(collectionId);
        return known != known_.end() && known->second >= number;
    };
    if (isKnown()) return {};
    RETURN_IF_ERROR(follow());
    if (isKnown()) return {};
    return fail(ErrorCode::kUnavailable, "at_least: change " + std::to_string(number) +
                                             " of the collection is not known to this server");
}

Result<void> ChangeFollower::followCollection(std::int64_t id, std::int64_t last) {
    const auto found = known_.find(id);
    if (found == known_.end()) return {};  // came since the directory was read
    std::int64_t& known = found->second;
    while (known < last) {
        const auto changes = parts_.store.changesAfter(id, known, kChangesAtATime);
        RETURN_IF_ERROR(changes);
        if (!isContinuous(*changes, known)) break;
        std::set<std::int64_t> shapes;
        for (const store::Change& change : *changes) shapes.insert(*change.shapeId);
        RETURN_IF_ERROR(parts_.index.refresh(id, {shapes.begin(), shapes.end()}));
        known = changes->back().number;
    }
    // A restore has begun another history, or there is more than one shape to an entry.
    if (known >= last) return {};
    const auto reloaded = parts_.index.reload(id);
    if (!reloaded && reloaded.error().code != ErrorCode::kNotFound) return reloaded;
    known = last;
    return {};
}

Result<void> ChangeFollower::followDirectory() {
    const std::lock_guard<std::mutex> lock(parts_.directory);
    const auto collections = parts_.store.listCollections();
    RETURN_IF_ERROR(collections);
    std::map<std::int64_t, std::string> gone;
    for (const index::SnapshotPtr& snapshot : parts_.index.all()) {
        gone.emplace(snapshot->collection.id, snapshot->collection.name);
    }
    for (const store::Collection& collection : *collections) {
        if (collection.damage) continue;
        const auto known = gone.find(collection.id);
        if (known == gone.end()) {
            RETURN_IF_ERROR(parts_.index.prepare(collection, {}));
            RETURN_IF_ERROR(parts_.index.show(collection.id));
            continue;
        }
        if (known->second != collection.name) {
            RETURN_IF_ERROR(parts_.index.rename(collection.id,
                                                [&]() -> Result<store::Collection> { return collection; }));
        }
        gone.erase(known);
    }
    for (const auto& [id, name] : gone) {
        parts_.index.remove(id);
        parts_.supersede(id);
        known_.erase(id);
    }
    const auto aliases = parts_.store.listAliases();
    RETURN_IF_ERROR(aliases);
    std::set<std::string> stored;
    for (const store::Alias& alias : *aliases) {
        stored.insert(alias.name);
        parts_.index.setAlias(alias.name, alias.collectionId);
    }
    for (const store::Collection& collection : *collections) {
        for (const std::string& alias : parts_.index.aliasesOf(collection.id)) {
            if (stored.count(alias) == 0) parts_.index.removeAlias(alias);
        }
    }
    return {};
}

}  // namespace shapedb::catalog
