// SPDX-License-Identifier: Apache-2.0
// How SIGINT and SIGTERM end the programs, and which others end those that wait. SIGPIPE is ignored: when a
// reader goes away, the write fails.
#pragma once

#include <atomic>

namespace shapedb {

/// For programs that look at a flag: from now on the first signal sets it, and a second ends the
/// program at once. Call from main; the flag is the process's only one.
[[nodiscard]] const std::atomic<bool>& stopFlag();

/// For programs that wait for a signal and end cleanly after it: SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGPWR
/// (the power fails), SIGXCPU (a limit of processor time). Others whose only use here would be to end the
/// process (SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGIO, SIGSTKFLT, those for real time) are ignored. Those
/// of crashes, and SIGKILL, stay as they are. Construct it in main before any thread: the threads inherit the
/// blocked signals.
class StopSignals {
  public:
    StopSignals();

    /// Waits for a signal and returns its number. A second one, of those that people send (SIGTERM, SIGINT,
    /// SIGHUP, SIGQUIT), then ends the process at once with `exitCode`.
    int wait(int exitCode) const;
};

}  // namespace shapedb
