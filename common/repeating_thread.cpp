// SPDX-License-Identifier: Apache-2.0
#include "common/repeating_thread.h"

#include <utility>

namespace shapedb {

RepeatingThread::RepeatingThread(std::chrono::milliseconds interval, std::function<void()> work)
    : thread_([this, interval, work = std::move(work)] {
          std::unique_lock<std::mutex> lock(mutex_);
          while (!wake_.wait_for(lock, interval, [this] { return ending_; })) {
              lock.unlock();
              work();
              lock.lock();
          }
      }) {}

RepeatingThread::~RepeatingThread() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

}  // namespace shapedb
