// SPDX-License-Identifier: Apache-2.0
// How SIGINT and SIGTERM end the programs, and SIGHUP those that wait. SIGPIPE is ignored: when a reader goes
// away, the write fails.
#pragma once

#include <atomic>

namespace shapedb {

/// For programs that look at a flag: from now on the first signal sets it, and a second ends the
/// program at once. Call from main; the flag is the process's only one.
[[nodiscard]] const std::atomic<bool>& stopFlag();

/// For programs that wait for a signal. Construct it in main before any thread: the threads inherit
/// the blocked signals.
class StopSignals {
  public:
    StopSignals();

    /// Waits for a signal and returns its number. A second one then ends the process at once with
    /// `exitCode`.
    int wait(int exitCode) const;
};

}  // namespace shapedb
