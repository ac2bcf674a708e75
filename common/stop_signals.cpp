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

constexpr int kOfPeople[] = {SIGTERM, SIGINT, SIGHUP, SIGQUIT};  // SIGHUP: the terminal has gone
constexpr int kOfTheSystem[] = {SIGPWR, SIGXCPU};
constexpr int kWithoutUse[] = {SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGIO, SIGSTKFLT};

sigset_t signalsOfPeople() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : kOfPeople) sigaddset(&signals, signal);
    return signals;
}

sigset_t endSignals() {
    sigset_t signals = signalsOfPeople();
    for (const int signal : kOfTheSystem) sigaddset(&signals, signal);
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
    for (const int signal : kWithoutUse) std::signal(signal, SIG_IGN);
    for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) std::signal(signal, SIG_IGN);
}

int StopSignals::wait(int exitCode) const {
    const sigset_t signals = endSignals();
    int received = 0;
    sigwait(&signals, &received);
    // Not the system's, which repeats SIGXCPU every second.
    std::thread([signals = signalsOfPeople(), exitCode] {
        int second = 0;
        sigwait(&signals, &second);
        ::_exit(exitCode);
    }).detach();
    return received;
}

}  // namespace shapedb
