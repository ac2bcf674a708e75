// One process at a time: a lock file beside the database.
#pragma once

#include <string>

namespace shapedb::store {

/// Holds an exclusive flock on `path` + ".lock" for its lifetime; the file stays and contains
/// the owner's process id. The kernel drops the lock with the process, however it ends.
class ProcessLock {
  public:
    /// Throws Failure kStorage: held by another (the message names its process id), or the
    /// file cannot be created.
    explicit ProcessLock(const std::string& databasePath);
    ~ProcessLock();
    ProcessLock(const ProcessLock&) = delete;
    ProcessLock& operator=(const ProcessLock&) = delete;

  private:
    int descriptor_ = -1;
};

}  // namespace shapedb::store
