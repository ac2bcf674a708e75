// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/job_leases.h"

namespace shapedb::store {

JobLeases::JobLeases(std::chrono::milliseconds lease, Renew renew)
    : renew_(std::move(renew)), thread_([this, lease] { run(lease / 3); }) {}

JobLeases::~JobLeases() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stop_ = true;
    }
    stopped_.notify_one();
    thread_.join();
}

void JobLeases::add(std::int64_t jobId) {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_.insert(jobId);
}

void JobLeases::remove(std::int64_t jobId) {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_.erase(jobId);
}

void JobLeases::run(std::chrono::milliseconds pause) {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopped_.wait_for(lock, pause, [this] { return stop_; })) {
        const std::vector<std::int64_t> jobs(held_.begin(), held_.end());
        lock.unlock();
        renew_(jobs);
        lock.lock();
    }
}

}  // namespace shapedb::store
