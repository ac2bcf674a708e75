// The `shapedb` command.
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <iostream>

#include <unistd.h>

#include "client/cli/console.h"
#include "client/cli/session.h"

namespace {

// The one thing a signal handler may touch.
std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void onInterrupt(int signal) {
    interrupted.store(true, std::memory_order_relaxed);
    // A second Ctrl-C ends the program at once.
    std::signal(signal, SIG_DFL);
}

}  // namespace

int main(int argc, char** argv) {
    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
    // A reader that goes away (`shapedb list | head -1`) is a failed write, not a crash.
    std::signal(SIGPIPE, SIG_IGN);
    // gRPC writes its own log lines to standard error unless told not to; errors reach the user
    // through the results of the calls.
    setenv("GRPC_VERBOSITY", "NONE", 0);

    shapedb::cli::Console console(std::cout, std::cerr, isatty(STDERR_FILENO) != 0);
    return shapedb::cli::run(argc, argv, console, interrupted);
}
