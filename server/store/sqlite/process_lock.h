// SPDX-License-Identifier: GPL-3.0-or-later
// One process at a time: a lock file beside the database.
#pragma once

#include <string>

namespace shapedb::store {

/// Holds an exclusive flock on the database path + ".lock". The kernel releases it however the process
/// ends; the file stays and contains the owner's process id, and a second line once `setComplete` was called.
class ProcessLock {
  public:
    /// Throws Failure kStorage: another process has it (names its id), or the file cannot be created.
    explicit ProcessLock(const std::string& databasePath);
    ~ProcessLock();
    ProcessLock(const ProcessLock&) = delete;
    ProcessLock& operator=(const ProcessLock&) = delete;
    /// Remembers, from one owner to the next, that the files beside the database are complete.
    void setComplete() noexcept;
    [[nodiscard]] bool wasComplete() const noexcept { return wasComplete_; }

  private:
    bool wasComplete_ = false;
    int descriptor_ = -1;
};

}  // namespace shapedb::store
