// SPDX-License-Identifier: GPL-3.0-or-later
// Keeps the leases of the jobs that this server has claimed: while a job is being segmented, nobody else
// takes it. A server that stops renewing, because it has died, hangs, or has lost the database, loses its
// jobs.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace shapedb::store {

/// Thread-safe.
class JobLeases {
  public:
    /// Extends the leases of these jobs, of which there may be none, and queues again those of any server
    /// whose lease has ended. What fails is tried again.
    using Renew = std::function<void(const std::vector<std::int64_t>& jobIds)>;

    /// Renews at a third of `lease`, on a thread of its own.
    JobLeases(std::chrono::milliseconds lease, Renew renew);
    ~JobLeases();
    JobLeases(const JobLeases&) = delete;
    JobLeases& operator=(const JobLeases&) = delete;

    void add(std::int64_t jobId);
    void remove(std::int64_t jobId);

  private:
    void run(std::chrono::milliseconds pause);

    Renew renew_;
    std::mutex mutex_;
    std::condition_variable stopped_;
    bool stop_ = false;
    std::set<std::int64_t> held_;
    std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace shapedb::store
