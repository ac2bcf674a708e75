// The `shapedb-bench` program.
#include <atomic>
#include <csignal>
#include <iostream>

#include <unistd.h>

#include "bench/program.h"
#include "client/cli/console.h"

namespace {

// All that a signal handler may touch.
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
    std::signal(SIGPIPE, SIG_IGN);
    shapedb::cli::Console console(std::cout, std::cerr, isatty(STDERR_FILENO) != 0,
                                  shapedb::bench::kProgramName);
    return shapedb::bench::run(argc, argv, console, interrupted);
}
