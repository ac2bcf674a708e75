// SPDX-License-Identifier: Apache-2.0
#include "common/child_process.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr const char* kOurVariables = "SHAPEDB_";
constexpr const char* kBanner = "listening on ";
constexpr std::size_t kLogTail = 2'000;

std::vector<std::string> environmentWith(const std::map<std::string, std::string>& own) {
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        if (std::strncmp(*entry, kOurVariables, std::strlen(kOurVariables)) != 0) all.emplace_back(*entry);
    }
    for (const auto& [name, value] : own) all.push_back(name + "=" + value);
    return all;
}

/// As execve wants them.
std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

std::string endOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    return text.size() <= kLogTail ? text : text.substr(text.size() - kLogTail);
}

tl::unexpected<Error> systemError(const char* what) {
    return fail(ErrorCode::kInternal, std::string(what) + ": " + std::strerror(errno));
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::string& program, std::vector<std::string> arguments,
                                         const std::map<std::string, std::string>& environment, int out,
                                         int err) {
    // All memory is allocated before the fork: the child may only make system calls.
    arguments.insert(arguments.begin(), program);
    std::vector<std::string> variables = environmentWith(environment);
    const std::vector<char*> argv = pointers(arguments);
    const std::vector<char*> envp = pointers(variables);
    const pid_t child = ::fork();
    if (child < 0) return systemError("cannot start a process");
    if (child == 0) {
        ::dup2(out, STDOUT_FILENO);
        ::dup2(err, STDERR_FILENO);
        ::execve(program.c_str(), argv.data(), envp.data());
        ::_exit(127);
    }
    return ChildProcess(child);
}

bool ChildProcess::running() const {
    if (id_ <= 0) return false;
    // Only looks: `wait` still gets the exit code.
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == 0;
}

void ChildProcess::signal(int number) const {
    if (id_ > 0) ::kill(id_, number);
}

int ChildProcess::wait(std::chrono::milliseconds atMost) {
    const auto until = std::chrono::steady_clock::now() + atMost;
    while (id_ > 0 && std::chrono::steady_clock::now() < until) {
        int status = 0;
        if (::waitpid(id_, &status, WNOHANG) == id_) {
            id_ = -1;
            return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return -1;
}

void ChildProcess::kill() {
    if (id_ <= 0) return;
    ::kill(id_, SIGKILL);
    ::waitpid(id_, nullptr, 0);
    id_ = -1;
}

Result<ShapedbdProcess> ShapedbdProcess::start(const Options& options) {
    int pipe[2];
    if (::pipe2(pipe, O_CLOEXEC) != 0) return systemError("no pipe");
    const int log = ::open(options.logFile.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
    std::vector<std::string> arguments = {"--listen", "127.0.0.1:0", "--data", options.data};
    arguments.insert(arguments.end(), options.flags.begin(), options.flags.end());
    auto child = ChildProcess::start(options.program, std::move(arguments), {}, pipe[1], log);
    ::close(pipe[1]);
    if (log >= 0) ::close(log);
    if (!child) {
        ::close(pipe[0]);
        return fail(child.error());
    }
    ShapedbdProcess server(std::move(*child), pipe[0]);
    RETURN_IF_ERROR(server.awaitAddress(options));
    return server;
}

Result<void> ShapedbdProcess::awaitAddress(const Options& options) {
    const auto until = std::chrono::steady_clock::now() + options.startTime;
    while (banner_.find('\n') == std::string::npos && std::chrono::steady_clock::now() < until) {
        pollfd ready{output_, POLLIN, 0};
        if (::poll(&ready, 1, 100) <= 0) continue;
        char buffer[256];
        const ssize_t count = ::read(output_, buffer, sizeof buffer);
        if (count <= 0) break;
        banner_.append(buffer, static_cast<std::size_t>(count));
    }
    const std::size_t at = banner_.find(kBanner);
    const std::size_t end = banner_.find('\n');
    if (at == std::string::npos || end == std::string::npos) {
        return fail(ErrorCode::kUnavailable, "shapedbd did not start: " + endOf(options.logFile));
    }
    const std::size_t from = at + std::strlen(kBanner);
    address_ = banner_.substr(from, end - from);
    return {};
}

ShapedbdProcess::ShapedbdProcess(ShapedbdProcess&& other) noexcept
    : process_(std::move(other.process_)),
      output_(std::exchange(other.output_, -1)),
      banner_(std::move(other.banner_)),
      address_(std::move(other.address_)) {}

ShapedbdProcess::~ShapedbdProcess() {
    process_.kill();
    if (output_ >= 0) ::close(output_);
}

}  // namespace shapedb
