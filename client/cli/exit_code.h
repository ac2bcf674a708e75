// SPDX-License-Identifier: GPL-3.0-or-later
// Exit codes; docs/command-line.md lists them with the error names.
#pragma once

#include "core/base/error.h"

namespace shapedb::cli {

enum ExitCode : int {
    kOk = 0,
    kSomeFailed = 1,    ///< some of several items failed
    kUsage = 2,         ///< wrong command line, parameter, filter or cursor
    kBadData = 3,       ///< a file that cannot be read or written, or a scan that cannot be used
    kWrongState = 4,    ///< not found, already there, or not allowed now
    kUnavailable = 5,   ///< the server cannot be reached, is full, or took too long
    kDefect = 6,        ///< storage, memory or a bug: not the caller's fault
    kInterrupted = 130  ///< Ctrl-C (128 + SIGINT, as in shells)
};

/// For a command that ended with this error.
[[nodiscard]] ExitCode exitCodeOf(ErrorCode code) noexcept;

}  // namespace shapedb::cli
