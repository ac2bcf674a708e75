#include "tests/integration/support/server_process.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

namespace shapedb::testing {
namespace {

constexpr std::chrono::seconds kStartTime{60};

/// `environ` without our variables, with those given.
std::vector<std::string> environmentWith(const std::map<std::string, std::string>& own) {
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        if (std::string(*entry).rfind("SHAPEDB_", 0) != 0) all.emplace_back(*entry);
    }
    for (const auto& [name, value] : own) all.push_back(name + "=" + value);
    return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

/// The child's standard output and error are the given descriptors.
pid_t spawn(std::vector<std::string> arguments, const std::map<std::string, std::string>& own, int out,
            int err) {
    arguments.insert(arguments.begin(), SHAPEDBD_PATH);
    std::vector<std::string> environment = environmentWith(own);
    const std::vector<char*> argv = pointers(arguments);
    const std::vector<char*> envp = pointers(environment);
    const pid_t child = ::fork();
    if (child == 0) {
        ::dup2(out, STDOUT_FILENO);
        ::dup2(err, STDERR_FILENO);
        ::execve(SHAPEDBD_PATH, argv.data(), envp.data());
        ::_exit(127);
    }
    return child;
}

}  // namespace

std::string readFile(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

TemporaryDirectory::TemporaryDirectory() {
    path_ = ::testing::TempDir() + "shapedb-XXXXXX";
    if (::mkdtemp(path_.data()) == nullptr) ADD_FAILURE() << "no temporary directory at " << path_;
}

TemporaryDirectory::~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

Finished runServer(const std::vector<std::string>& arguments,
                   const std::map<std::string, std::string>& environment) {
    const TemporaryDirectory directory;
    const auto create = [&](const char* name) {
        return ::open((directory.path() + name).c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    };
    const int out = create("/out");
    const int err = create("/err");
    int status = 0;
    ::waitpid(spawn(arguments, environment, out, err), &status, 0);
    ::close(out);
    ::close(err);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, readFile(directory.path() + "/out"),
            readFile(directory.path() + "/err")};
}

ServerProcess::ServerProcess(const std::string& directory, const std::vector<std::string>& arguments)
    : logFile_(directory + "/server.log") {
    std::vector<std::string> all = {"--listen", "127.0.0.1:0", "--data", directory + "/data"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    int pipe[2];
    if (::pipe2(pipe, O_CLOEXEC) != 0) ADD_FAILURE() << "no pipe";
    const int logOutput = ::open(logFile_.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
    process_ = spawn(all, {}, pipe[1], logOutput);
    ::close(pipe[1]);
    ::close(logOutput);
    output_ = pipe[0];

    const auto until = std::chrono::steady_clock::now() + kStartTime;
    while (banner_.find('\n') == std::string::npos && std::chrono::steady_clock::now() < until) {
        pollfd ready{output_, POLLIN, 0};
        if (::poll(&ready, 1, 100) <= 0) continue;
        char buffer[256];
        const ssize_t count = ::read(output_, buffer, sizeof buffer);
        if (count <= 0) break;
        banner_.append(buffer, static_cast<std::size_t>(count));
    }
    const std::string prefix = "listening on ";
    const std::size_t at = banner_.find(prefix);
    if (at == std::string::npos) {
        ADD_FAILURE() << "shapedbd did not start:\n" << log();
        return;
    }
    address_ = banner_.substr(at + prefix.size(), banner_.find('\n', at) - at - prefix.size());
}

ServerProcess::~ServerProcess() {
    kill();
    if (output_ >= 0) ::close(output_);
    if (::testing::Test::HasFailure()) std::fprintf(stderr, "--- log of shapedbd\n%s---\n", log().c_str());
}

void ServerProcess::signal(int number) const {
    if (process_ > 0) ::kill(process_, number);
}

bool ServerProcess::running() const { return process_ > 0 && ::waitpid(process_, nullptr, WNOHANG) == 0; }

int ServerProcess::wait(std::chrono::seconds atMost) {
    const auto until = std::chrono::steady_clock::now() + atMost;
    while (process_ > 0 && std::chrono::steady_clock::now() < until) {
        int status = 0;
        if (::waitpid(process_, &status, WNOHANG) == process_) {
            process_ = -1;
            return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return -1;
}

void ServerProcess::kill() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
    process_ = -1;
}

std::string ServerProcess::log() const { return readFile(logFile_); }

}  // namespace shapedb::testing
