// SPDX-License-Identifier: Apache-2.0
// A thread that does the same again and again.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace shapedb {

/// Calls `work` once per `interval`, the first time after one, until it is destroyed, which waits for a call
/// that runs. `work` must not throw.
class RepeatingThread {
  public:
    RepeatingThread(std::chrono::milliseconds interval, std::function<void()> work)
        : thread_([this, interval, work = std::move(work)] {
              std::unique_lock<std::mutex> lock(mutex_);
              while (!wake_.wait_for(lock, interval, [this] { return ending_; })) {
                  lock.unlock();
                  work();
                  lock.lock();
              }
          }) {}
    ~RepeatingThread() {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            ending_ = true;
        }
        wake_.notify_all();
        thread_.join();
    }
    RepeatingThread(const RepeatingThread&) = delete;
    RepeatingThread& operator=(const RepeatingThread&) = delete;

  private:
    std::mutex mutex_;
    std::condition_variable wake_;
    bool ending_ = false;
    std::thread thread_;
};

}  // namespace shapedb
