// SPDX-License-Identifier: Apache-2.0
#include "common/stop_signals.h"

#include <csignal>
#include <thread>

#include <unistd.h>

namespace shapedb {

namespace {

// The only thing the signal handler touches.
std::atomic<bool> stopRequested{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void requestStop(int signal) {
    stopRequested.store(true, std::memory_order_relaxed);
    std::signal(signal, SIG_DFL);
}

sigset_t endSignals() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGHUP);  // its terminal has gone
    return signals;
}

}  // namespace

const std::atomic<bool>& stopFlag() {
    std::signal(SIGINT, requestStop);
    std::signal(SIGTERM, requestStop);
    std::signal(SIGPIPE, SIG_IGN);
    return stopRequested;
}

StopSignals::StopSignals() {
    const sigset_t signals = endSignals();
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
}

int StopSignals::wait(int exitCode) const {
    const sigset_t signals = endSignals();
    int received = 0;
    sigwait(&signals, &received);
    std::thread([signals, exitCode] {
        int second = 0;
        sigwait(&signals, &second);
        ::_exit(exitCode);
    }).detach();
    return received;
}

}  // namespace shapedb
