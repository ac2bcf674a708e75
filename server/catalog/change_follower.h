// SPDX-License-Identifier: GPL-3.0-or-later
// Keeps the index of this server up to date with what other servers change in a database that they share. It
// reads the log of each collection (store::Store::changesAfter) in order, some five times a second, and again
// what its own server changed, which costs little. A restore or a rebuild by another server is one entry: the
// collection is loaded again and replaced as a whole, so that no search mixes two generations.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "core/base/error.h"
#include "server/catalog/gates.h"
#include "server/index/collection_index.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::catalog {

class ChangeFollower {
  public:
    struct Parts {
        store::Store& store;
        index::CollectionIndex& index;
        RestoreGate& restores;
        /// Held while collections come, go, or change their names.
        std::mutex& directory;
        /// After each pass: there may be jobs of other servers.
        std::function<void()> wake;
        /// Of a collection that is gone.
        std::function<void(std::int64_t collectionId)> supersede;
        telemetry::LoggerPtr log;
    };

    explicit ChangeFollower(Parts parts) : parts_(std::move(parts)) {}
    ~ChangeFollower() { stop(); }
    ChangeFollower(const ChangeFollower&) = delete;
    ChangeFollower& operator=(const ChangeFollower&) = delete;

    /// Notes where the logs stand; before the index is loaded, so that no change is missed.
    [[nodiscard]] Result<void> begin();
    /// Follows on a thread of its own until `stop`.
    void start();
    void stop();
    /// Whether the last pass could read the logs.
    [[nodiscard]] bool isFollowing() const { return following_.load(); }
    /// One pass: applies what is in the logs now. Thread-safe.
    [[nodiscard]] Result<void> follow();
    /// The same, unless this change of the collection was applied before. Errors: kUnavailable (there is no
    /// such change).
    [[nodiscard]] Result<void> followTo(std::int64_t collectionId, std::int64_t number);

  private:
    void run();
    Result<void> followCollection(std::int64_t id, std::int64_t last);
    Result<void> followDirectory();

    Parts parts_;
    std::atomic<bool> following_{true};
    std::mutex pass_;  ///< guards the next two
    std::int64_t directory_ = 0;
    std::map<std::int64_t, std::int64_t> known_;  ///< last change applied, by collection
    std::mutex mutex_;
    std::condition_variable stopped_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace shapedb::catalog
