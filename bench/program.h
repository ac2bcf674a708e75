// The program around the operations: reads the command line and runs the one the user named.
#pragma once

#include <atomic>

#include "client/cli/console.h"

namespace shapedb::bench {

inline constexpr const char* kProgramName = "shapedb-bench";

/// The whole program but for the signal handler: prints the operation's result or error, and
/// gives the exit code (those of the `shapedb` command, client/cli/exit_code.h). Never throws.
[[nodiscard]] int run(int argc, const char* const* argv, cli::Console& console,
                      const std::atomic<bool>& cancel);

}  // namespace shapedb::bench
