// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/pool.h"

namespace shapedb::store {

PostgresPool::Lease PostgresPool::acquire() {
    {
        std::unique_lock<std::mutex> lock(mutex_);
        freed_.wait(lock, [this] { return !free_.empty() || left_ > 0; });
        if (!free_.empty()) {
            auto connection = std::move(free_.back());
            free_.pop_back();
            return {*this, std::move(connection)};
        }
        free_.reserve(free_.size() + 1);
        --left_;
    }
    try {
        // Not under the lock: it may take as long as the database likes.
        return {*this, std::make_unique<PostgresConnection>(address_, texts_)};
    } catch (...) {
        giveBack(nullptr);
        throw;
    }
}

void PostgresPool::closeIdle() {
    std::vector<std::unique_ptr<PostgresConnection>> closed;
    const std::lock_guard<std::mutex> lock(mutex_);
    closed.swap(free_);
    left_ += static_cast<int>(closed.size());
}

void PostgresPool::giveBack(std::unique_ptr<PostgresConnection> connection) noexcept {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
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
    freed_.notify_one();
}

}  // namespace shapedb::store
