// What the shell gets back. docs/command-line.md lists the same numbers.
#pragma once

#include "core/base/error.h"

namespace shapedb::cli {

enum ExitCode : int {
    kOk = 0,
    kSomeFailed = 1,    ///< several items were asked for, some of them failed
    kUsage = 2,         ///< the command line, a parameter, a filter or a cursor is wrong
    kBadData = 3,       ///< a file cannot be read or written, or its points are no usable scan
    kWrongState = 4,    ///< not found, already there, or not allowed in this state
    kUnavailable = 5,   ///< the server is not reachable, full, or took too long
    kDefect = 6,        ///< storage, memory or a defect: nothing the caller asked wrongly
    kInterrupted = 130  ///< stopped by Ctrl-C (128 + SIGINT, as shells count)
};

/// The exit code of a command that ended with this error.
[[nodiscard]] ExitCode exitCodeOf(ErrorCode code) noexcept;

}  // namespace shapedb::cli
