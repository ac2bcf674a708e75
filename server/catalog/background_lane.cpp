// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/background_lane.h"

#include <exception>
#include <optional>

#include "server/ingest/background_thread.h"

namespace shapedb::catalog {

/// One call of `run`. Everything but the first two is guarded by the lane's mutex.
struct BackgroundLane::Job {
    const std::size_t count;
    const std::function<Result<void>(std::size_t)>& piece;
    std::size_t next = 0;     ///< to begin
    std::size_t running = 0;  ///< pieces
    std::size_t failedAt = count;
    std::optional<Error> error{};  ///< of that piece
    std::exception_ptr thrown{};

    [[nodiscard]] bool hasMore() const { return next < count && !error && !thrown; }
};

BackgroundLane::BackgroundLane(int threads) {
    for (int i = 0; i < threads; ++i) {
        threads_.emplace_back([this] {
            ingest::becomeBackgroundThread();
            ingest::onThisThreadAlone([this] { work(); });
        });
    }
}

BackgroundLane::~BackgroundLane() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        ending_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

Result<void> BackgroundLane::run(std::size_t count, const std::function<Result<void>(std::size_t)>& piece) {
    Job job{count, piece};
    std::unique_lock<std::mutex> lock(mutex_);
    if (count > 0) waiting_.push_back(&job);
    changed_.notify_all();
    changed_.wait(lock, [&] { return !job.hasMore() && job.running == 0; });
    if (job.thrown) std::rethrow_exception(job.thrown);
    return job.error ? Result<void>(fail(*job.error)) : Result<void>();
}

void BackgroundLane::work() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
        if (ending_) return;
        take(lock);
    }
}

void BackgroundLane::take(std::unique_lock<std::mutex>& lock) {
    Job& job = *waiting_.front();
    waiting_.pop_front();
    const std::size_t at = job.next++;
    ++job.running;
    // Behind the others: each call gets a piece in turn.
    if (job.hasMore()) waiting_.push_back(&job);
    lock.unlock();
    Result<void> done;
    std::exception_ptr thrown;
    try {
        done = job.piece(at);
    } catch (...) {
        thrown = std::current_exception();
    }
    lock.lock();
    --job.running;
    if (thrown) job.thrown = thrown;
    if (!done && at < job.failedAt) {
        job.failedAt = at;
        job.error = done.error();
    }
    if (!job.hasMore()) {
        // It may have been queued before it failed.
        for (auto it = waiting_.begin(); it != waiting_.end();)
            it = *it == &job ? waiting_.erase(it) : it + 1;
        if (job.running == 0) changed_.notify_all();
    }
}

}  // namespace shapedb::catalog
