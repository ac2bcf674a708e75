#include "bench/server_process.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

constexpr std::chrono::minutes kStartTime{10};
constexpr std::size_t kLogTail = 2'000;
constexpr const char* kBanner = "listening on ";

/// Without our environment variables, so that only the flags count.
std::vector<std::string> plainEnvironment() {
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        if (std::strncmp(*entry, "SHAPEDB_", 8) != 0) all.emplace_back(*entry);
    }
    return all;
}

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

std::string procPath(pid_t process, const char* name) {
    return "/proc/" + std::to_string(process) + "/" + name;
}

tl::unexpected<Error> gone() { return fail(ErrorCode::kUnavailable, "shapedbd is not running any more"); }

}  // namespace

Result<WorkDirectory> WorkDirectory::create(const std::string& parent) {
    std::error_code error;
    const std::filesystem::path base =
        parent.empty() ? std::filesystem::temp_directory_path(error) : std::filesystem::path(parent);
    std::string path = (base / "shapedb-bench-XXXXXX").string();
    if (error || ::mkdtemp(path.data()) == nullptr) {
        return fail(ErrorCode::kFileNotWritable,
                    "cannot create a directory in " + base.string() + ": " + std::strerror(errno));
    }
    return WorkDirectory(std::move(path));
}

WorkDirectory::~WorkDirectory() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

WorkDirectory::WorkDirectory(WorkDirectory&& other) noexcept : path_(std::exchange(other.path_, {})) {}

Result<ServerProcess> ServerProcess::start(const std::string& program, const std::string& data,
                                           const std::vector<std::string>& flags) {
    if (::access(program.c_str(), X_OK) != 0) {
        return fail(ErrorCode::kFileNotReadable,
                    "there is no server program " + program + ": build shapedbd, or name it with --server");
    }
    std::vector<std::string> arguments = {program, "--listen", "127.0.0.1:0", "--data", data};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    std::vector<std::string> environment = plainEnvironment();
    const std::vector<char*> argv = pointers(arguments);
    const std::vector<char*> envp = pointers(environment);
    const std::string log = data + ".log";
    int pipe[2];
    if (::pipe2(pipe, O_CLOEXEC) != 0)
        return fail(ErrorCode::kInternal, std::string("no pipe: ") + std::strerror(errno));
    ServerProcess server;
    server.output_ = pipe[0];
    const int logOutput = ::open(log.c_str(), O_CREAT | O_WRONLY | O_TRUNC | O_CLOEXEC, 0600);
    server.process_ = ::fork();
    if (server.process_ == 0) {
        ::dup2(pipe[1], STDOUT_FILENO);
        if (logOutput >= 0) ::dup2(logOutput, STDERR_FILENO);
        ::execve(program.c_str(), argv.data(), envp.data());
        ::_exit(127);
    }
    ::close(pipe[1]);
    if (logOutput >= 0) ::close(logOutput);
    if (server.process_ < 0)
        return fail(ErrorCode::kInternal, std::string("no process: ") + std::strerror(errno));
    RETURN_IF_ERROR(server.awaitAddress(log));
    return server;
}

Result<void> ServerProcess::awaitAddress(const std::string& log) {
    const auto until = std::chrono::steady_clock::now() + kStartTime;
    std::string text;
    while (text.find('\n') == std::string::npos && std::chrono::steady_clock::now() < until) {
        pollfd ready{output_, POLLIN, 0};
        if (::poll(&ready, 1, 100) <= 0) continue;
        char buffer[256];
        const ssize_t count = ::read(output_, buffer, sizeof buffer);
        if (count <= 0) break;
        text.append(buffer, static_cast<std::size_t>(count));
    }
    const std::size_t at = text.find(kBanner);
    const std::size_t end = text.find('\n');
    if (at == std::string::npos || end == std::string::npos)
        return fail(ErrorCode::kUnavailable, "shapedbd did not start: " + endOf(log));
    const std::size_t from = at + std::strlen(kBanner);
    address_ = text.substr(from, end - from);
    return {};
}

ServerProcess::~ServerProcess() {
    if (process_ > 0) {
        ::kill(process_, SIGKILL);
        ::waitpid(process_, nullptr, 0);
    }
    if (output_ >= 0) ::close(output_);
}

ServerProcess::ServerProcess(ServerProcess&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      output_(std::exchange(other.output_, -1)),
      address_(std::move(other.address_)) {}

Result<MemoryUse> ServerProcess::memory() const {
    MemoryUse use;
    std::ifstream status(procPath(process_, "status"));
    for (std::string line; std::getline(status, line);) {
        std::istringstream words(line);
        std::string name;
        std::uint64_t kibibytes = 0;
        if (!(words >> name >> kibibytes)) continue;
        if (name == "VmRSS:") use.resident = kibibytes * 1024;
        if (name == "VmHWM:") use.peak = kibibytes * 1024;
    }
    if (use.resident == 0) return gone();
    return use;
}

bool ServerProcess::forgetPeak() const {
    // proc(5): 5 resets the peak resident set size to the present one.
    std::ofstream file(procPath(process_, "clear_refs"));
    file << "5" << std::flush;
    return file.good();
}

Result<double> ServerProcess::processorSeconds() const {
    std::ifstream file(procPath(process_, "stat"));
    std::string text;
    std::getline(file, text);
    // Fields 14 and 15, counted from 1; the second, in brackets, may hold blanks.
    const std::size_t bracket = text.rfind(')');
    if (bracket == std::string::npos) return gone();
    std::istringstream words(text.substr(bracket + 1));
    std::string skipped;
    for (int field = 3; field < 14; ++field) words >> skipped;
    double user = 0.0;
    double system = 0.0;
    if (!(words >> user >> system)) return gone();
    return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace shapedb::bench
