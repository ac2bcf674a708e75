// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/pool.h"

namespace shapedb::store {

ReaderPool::ReaderPool(const std::string& path, int count, int busyTimeoutMs) {
    free_.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        free_.push_back(std::make_unique<SqliteConnection>(path, OpenMode::kReadOnly, busyTimeoutMs));
    }
}

ReaderPool::Lease ReaderPool::acquire() {
    std::unique_lock<std::mutex> lock(mutex_);
    freed_.wait(lock, [this] { return !free_.empty(); });
    // The last one returned has the warmest page cache.
    std::unique_ptr<SqliteConnection> connection = std::move(free_.back());
    free_.pop_back();
    return {*this, std::move(connection)};
}

void ReaderPool::giveBack(std::unique_ptr<SqliteConnection> connection) {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        free_.push_back(std::move(connection));  // never allocates: reserved for all
    }
    freed_.notify_one();
}

}  // namespace shapedb::store
