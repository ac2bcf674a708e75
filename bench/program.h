// SPDX-License-Identifier: GPL-3.0-or-later
// The program: reads the command line and runs the operation the user chose.
#pragma once

#include <atomic>

#include "client/cli/console.h"

namespace shapedb::bench {

inline constexpr const char* kProgramName = "shapedb-bench";

/// The whole program except the signal handler: prints the operation's result or error and returns the
/// exit code (those of the `shapedb` command, client/cli/exit_code.h). Never throws.
[[nodiscard]] int run(int argc, const char* const* argv, cli::Console& console,
                      const std::atomic<bool>& cancel);

}  // namespace shapedb::bench
