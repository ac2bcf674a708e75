// SPDX-License-Identifier: GPL-3.0-or-later
// Collects the answers of several servers that were asked at once.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "server/cluster/shard_query.h"

namespace shapedb::cluster {

/// How often a wait for answers looks for cancellation.
constexpr std::chrono::milliseconds kInboxPause{20};

/// Answers in the order in which they come in. Thread-safe.
template <typename Answer>
class Inbox {
  public:
    using Entry = std::pair<std::uint64_t, Result<Answer>>;

    void put(std::uint64_t id, Result<Answer> answer) {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            entries_.emplace_back(id, std::move(answer));
        }
        came_.notify_one();
    }

    /// Nothing if none has come within kInboxPause.
    std::optional<Entry> take() {
        std::unique_lock<std::mutex> lock(mutex_);
        if (!came_.wait_for(lock, kInboxPause, [this] { return !entries_.empty(); })) return std::nullopt;
        Entry first = std::move(entries_.front());
        entries_.pop_front();
        return first;
    }

  private:
    std::mutex mutex_;
    std::condition_variable came_;
    std::deque<Entry> entries_;
};

/// Requests under way; the end of a search cancels those that it does not need any more.
class Requests {
  public:
    ~Requests() {
        for (const auto& request : requests_) request->cancel();
    }
    void add(std::unique_ptr<ShardTransport::Request> request) { requests_.push_back(std::move(request)); }

  private:
    std::vector<std::unique_ptr<ShardTransport::Request>> requests_;
};

}  // namespace shapedb::cluster
