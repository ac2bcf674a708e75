// SPDX-License-Identifier: GPL-3.0-or-later
// The `shapedb` command.
#include <cstdlib>
#include <iostream>

#include <unistd.h>

#include "client/cli/console.h"
#include "client/cli/session.h"
#include "common/build_info.h"
#include "common/stop_signals.h"

int main(int argc, char** argv) {
    const std::atomic<bool>& interrupted = shapedb::stopFlag();
    // gRPC writes its own log lines to standard error unless switched off; errors reach the user
    // through the results of the calls.
    setenv("GRPC_VERBOSITY", "NONE", 0);

    shapedb::cli::Console console(std::cout, std::cerr, shapedb::cli::terminalAt(STDERR_FILENO));
    return shapedb::cli::run(argc, argv, console, interrupted, shapedb::buildInfo());
}
