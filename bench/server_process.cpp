// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/server_process.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include <stdlib.h>
#include <unistd.h>

#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

constexpr std::chrono::minutes kStartTime{10};

std::string procPath(pid_t process, const char* name) {
    return "/proc/" + std::to_string(process) + "/" + name;
}

tl::unexpected<Error> gone() { return fail(ErrorCode::kUnavailable, "shapedbd is no longer running"); }

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
    ShapedbdProcess::Options options;
    options.program = program;
    options.data = data;
    options.logFile = data + ".log";
    options.flags = flags;
    options.startTime = kStartTime;
    auto started = ShapedbdProcess::start(options);
    RETURN_IF_ERROR(started);
    return ServerProcess(std::move(*started));
}

Result<MemoryUse> ServerProcess::memory() const {
    MemoryUse use;
    std::ifstream status(procPath(server_.process().id(), "status"));
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
    std::ofstream file(procPath(server_.process().id(), "clear_refs"));
    file << "5" << std::flush;
    return file.good();
}

Result<double> ServerProcess::processorSeconds() const {
    std::ifstream file(procPath(server_.process().id(), "stat"));
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

std::string serverBeside() {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return error ? "shapedbd" : (self.parent_path() / "shapedbd").string();
}

}  // namespace shapedb::bench
