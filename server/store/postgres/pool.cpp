// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/pool.h"

namespace shapedb::store {

void PostgresPool::wait(std::unique_lock<std::mutex>& lock, Use use, Clock::time_point until) {
    const bool writes = use == Use::kWrite;
    Queue& queue = writes ? writers_ : readers_;
    const auto me = queue.emplace(queue.end());
    const bool mayHave = freed_.wait_until(lock, until, [&] {
        return me == queue.begin() && (!free_.empty() || left_ > 0) && (!writes || writesLeft_ > 0);
    });
    queue.erase(me);
    freed_.notify_all();  // another one is the first now
    if (mayHave) return;
    raise(ErrorCode::kUnavailable,
          std::string("all connections for ") + (writes ? "writing" : "reading") +
              " are in use: the database is slow, another transaction holds them up, or "
              "postgres.connections is too low");
}

PostgresPool::Lease PostgresPool::acquire(Use use, Clock::time_point until) {
    {
        std::unique_lock<std::mutex> lock(mutex_);
        wait(lock, use, until);
        free_.reserve(free_.size() + 1);
        if (use == Use::kWrite) --writesLeft_;
        if (!free_.empty()) {
            auto connection = std::move(free_.back());
            free_.pop_back();
            return {*this, std::move(connection), use};
        }
        --left_;
    }
    try {
        // Not under the lock: it may take as long as the database likes.
        return {*this, std::make_unique<PostgresConnection>(address_, texts_), use};
    } catch (...) {
        giveBack(nullptr, use);
        throw;
    }
}

void PostgresPool::closeIdle() {
    std::vector<std::unique_ptr<PostgresConnection>> closed;
    const std::lock_guard<std::mutex> lock(mutex_);
    closed.swap(free_);
    left_ += static_cast<int>(closed.size());
}

void PostgresPool::giveBack(std::unique_ptr<PostgresConnection> connection, Use use) noexcept {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (use == Use::kWrite) ++writesLeft_;
        if (connection == nullptr || connection->isBroken()) {
            ++left_;
        } else {
            try {
                free_.push_back(std::move(connection));
            } catch (const std::bad_alloc&) {
                ++left_;
            }
        }
    }
    // Some wait for any, some for one that may write.
    freed_.notify_all();
}

}  // namespace shapedb::store
