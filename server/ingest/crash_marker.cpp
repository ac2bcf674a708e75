// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/crash_marker.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

namespace shapedb::ingest {

namespace {

constexpr int kSignals[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr std::size_t kSignalStackBytes = 64u << 10;
/// One line for each thread that crashes; a damaged file is not read for ever.
constexpr std::size_t kMostBytes = 4'096;

// A signal handler is given nothing: what it needs is here.
std::atomic<int> markerFile{-1};
thread_local std::atomic<std::int64_t> shapeInHand{0};
thread_local std::atomic<std::int64_t> versionInHand{0};

/// snprintf is not safe in a signal handler.
char* writeNumber(char* to, std::int64_t number) {
    std::array<char, 20> digits{};
    std::size_t count = 0;
    for (auto rest = static_cast<std::uint64_t>(number); rest > 0 || count == 0; rest /= 10) {
        digits[count++] = static_cast<char>('0' + rest % 10);
    }
    while (count > 0) *to++ = digits[--count];
    return to;
}

/// One sent by another process says nothing about the scan.
bool cameFromWithin(const siginfo_t& info) { return info.si_code > 0 || info.si_pid == ::getpid(); }

extern "C" void markCrash(int number, siginfo_t* info, void*) {
    const std::int64_t shape = shapeInHand.load();
    const int file = markerFile.load();
    if (shape > 0 && file >= 0 && cameFromWithin(*info)) {
        std::array<char, 64> line{};
        char* end = writeNumber(line.data(), shape);
        *end++ = ' ';
        end = writeNumber(end, versionInHand.load());
        *end++ = '\n';
        const ssize_t size = end - line.data();
        if (::write(file, line.data(), static_cast<std::size_t>(size)) == size) ::fsync(file);
    }
    // The handler was installed for one time: this ends the process as if there were none.
    ::raise(number);
}

std::vector<store::Crash> readCrashes(int file) {
    std::string text(kMostBytes, '\0');
    const ssize_t size = ::pread(file, text.data(), text.size(), 0);
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    std::vector<store::Crash> crashes;
    std::istringstream lines(text);
    store::Crash crash;
    while (lines >> crash.shapeId >> crash.pointsVersion) crashes.push_back(crash);
    return crashes;
}

/// Freed with its thread.
class SignalStack {
  public:
    SignalStack() : memory_(std::make_unique<char[]>(kSignalStackBytes)) {
        stack_t stack{};
        stack.ss_sp = memory_.get();
        stack.ss_size = kSignalStackBytes;
        ::sigaltstack(&stack, nullptr);
    }
    ~SignalStack() {
        stack_t none{};
        none.ss_flags = SS_DISABLE;
        ::sigaltstack(&none, nullptr);
    }
    SignalStack(const SignalStack&) = delete;
    SignalStack& operator=(const SignalStack&) = delete;

  private:
    std::unique_ptr<char[]> memory_;
};

}  // namespace

Result<std::vector<store::Crash>> installCrashMarker(const std::string& path) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (file < 0) {
        return fail(ErrorCode::kFileNotWritable,
                    path + " cannot be opened: " + std::generic_category().message(errno));
    }
    auto crashes = readCrashes(file);
    if (::ftruncate(file, 0) != 0) {
        const int why = errno;
        ::close(file);
        return fail(ErrorCode::kFileNotWritable,
                    path + " cannot be written: " + std::generic_category().message(why));
    }
    const int earlier = markerFile.exchange(file);
    if (earlier >= 0) ::close(earlier);
    for (const int number : kSignals) {
        struct sigaction action {};
        action.sa_sigaction = markCrash;
        action.sa_flags = SA_SIGINFO | SA_ONSTACK | static_cast<int>(SA_RESETHAND) | SA_NODEFER;
        ::sigaction(number, &action, nullptr);
    }
    return crashes;
}

InHand::InHand(std::int64_t shapeId, std::int64_t pointsVersion) {
    if (markerFile.load() < 0) return;
    thread_local const SignalStack stack;
    versionInHand = pointsVersion;
    shapeInHand = shapeId;
}

InHand::~InHand() { shapeInHand = 0; }

}  // namespace shapedb::ingest
