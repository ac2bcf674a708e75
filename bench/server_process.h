// SPDX-License-Identifier: GPL-3.0-or-later
// Runs shapedbd as a child process, so that its time and memory are measured separately.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/child_process.h"
#include "core/base/error.h"

namespace shapedb::bench {

/// A directory that is deleted with this object.
class WorkDirectory {
  public:
    /// Below `parent`; empty: the folder for temporary files. Errors: kFileNotWritable.
    [[nodiscard]] static Result<WorkDirectory> create(const std::string& parent);
    ~WorkDirectory();
    WorkDirectory(WorkDirectory&& other) noexcept;
    WorkDirectory& operator=(WorkDirectory&&) = delete;

    [[nodiscard]] const std::string& path() const { return path_; }

  private:
    explicit WorkDirectory(std::string path) : path_(std::move(path)) {}
    std::string path_;
};

/// The server that was built with this program.
[[nodiscard]] std::string serverBeside();

/// From /proc.
struct MemoryUse {
    std::uint64_t resident = 0;  ///< bytes now
    std::uint64_t peak = 0;      ///< most resident bytes since the start or since `forgetPeak`
};

/// Killed when destroyed. Not thread-safe.
class ServerProcess {
  public:
    /// Starts `program` on the data directory `data` and a free port of loopback, and waits until it
    /// listens. Its log goes to `data`.log. Errors: kFileNotReadable (no such program), kUnavailable
    /// (it ended, or does not listen within ten minutes; the message has the end of its log).
    [[nodiscard]] static Result<ServerProcess> start(const std::string& program, const std::string& data,
                                                     const std::vector<std::string>& flags);

    [[nodiscard]] const std::string& address() const { return server_.address(); }
    /// Errors: kUnavailable: it is gone.
    [[nodiscard]] Result<MemoryUse> memory() const;
    /// Restarts the peak. False where the system does not allow it.
    bool forgetPeak() const;
    /// Processor time it took so far, all threads, seconds. Errors: as `memory`.
    [[nodiscard]] Result<double> processorSeconds() const;

  private:
    explicit ServerProcess(ShapedbdProcess server) : server_(std::move(server)) {}

    ShapedbdProcess server_;
};

}  // namespace shapedb::bench
