// One process at a time: a lock file beside the database.
#pragma once

#include <string>

namespace shapedb::store {

/// Holds an exclusive flock on the database path + ".lock". The kernel releases it however the process
/// ends; the file stays and contains the owner's process id.
class ProcessLock {
  public:
    /// Throws Failure kStorage: another process has it (names its id), or the file cannot be created.
    explicit ProcessLock(const std::string& databasePath);
    ~ProcessLock();
    ProcessLock(const ProcessLock&) = delete;
    ProcessLock& operator=(const ProcessLock&) = delete;

  private:
    int descriptor_ = -1;
};

}  // namespace shapedb::store
