// SPDX-License-Identifier: GPL-3.0-or-later
// The `shapedb-bench` program.
#include <iostream>

#include <unistd.h>

#include "bench/operations.h"
#include "client/cli/console.h"
#include "common/stop_signals.h"

int main(int argc, char** argv) {
    const std::atomic<bool>& interrupted = shapedb::stopFlag();
    shapedb::cli::Console console(std::cout, std::cerr, shapedb::cli::terminalAt(STDERR_FILENO),
                                  shapedb::bench::kProgramName);
    return shapedb::bench::run(argc, argv, console, interrupted);
}
