// SPDX-License-Identifier: Apache-2.0
// Starts other programs, for tests and benchmarks.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "core/base/error.h"

namespace shapedb {

/// A running program. Killed when destroyed. Not thread-safe.
class ChildProcess {
  public:
    /// Runs `program` with `arguments`. It gets the environment of this process, but of variables
    /// SHAPEDB_* only those in `environment`. `out` and `err` become its standard output and error and
    /// stay open here. Errors: kInternal (no process). A program that cannot be run ends with 127.
    [[nodiscard]] static Result<ChildProcess> start(const std::string& program,
                                                    std::vector<std::string> arguments,
                                                    const std::map<std::string, std::string>& environment,
                                                    int out, int err);
    ~ChildProcess() { kill(); }
    ChildProcess(ChildProcess&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
    ChildProcess& operator=(ChildProcess&&) = delete;

    /// -1 once its end has been seen.
    [[nodiscard]] pid_t id() const { return id_; }
    [[nodiscard]] bool running() const;
    void signal(int number) const;
    /// Its exit code; -1 when a signal ended it or it still runs after `atMost`.
    int wait(std::chrono::milliseconds atMost = std::chrono::hours(1));
    /// SIGKILL, and waits. No effect after its end.
    void kill();
    /// Leaves the process alone from now on; returns its id.
    pid_t release() { return std::exchange(id_, -1); }

  private:
    explicit ChildProcess(pid_t id) : id_(id) {}

    pid_t id_ = -1;
};

/// A shapedbd on a free port of loopback, in a process of its own. Killed when destroyed.
class ShapedbdProcess {
  public:
    struct Options {
        std::string program;
        std::string data;                ///< data directory
        std::string logFile;             ///< its standard error is appended to this
        std::vector<std::string> flags;  ///< besides --listen and --data
        std::chrono::seconds startTime{60};
    };

    /// Returns once it listens. Errors: kInternal (no process); kUnavailable: it ended or did not
    /// listen in time; the message has the end of its log.
    [[nodiscard]] static Result<ShapedbdProcess> start(const Options& options);
    ~ShapedbdProcess();
    ShapedbdProcess(ShapedbdProcess&& other) noexcept;
    ShapedbdProcess& operator=(ShapedbdProcess&&) = delete;

    [[nodiscard]] ChildProcess& process() { return process_; }
    [[nodiscard]] const ChildProcess& process() const { return process_; }
    /// HOST:PORT.
    [[nodiscard]] const std::string& address() const { return address_; }
    /// What it wrote to standard output until it listened.
    [[nodiscard]] const std::string& banner() const { return banner_; }

  private:
    ShapedbdProcess(ChildProcess process, int output) : process_(std::move(process)), output_(output) {}
    Result<void> awaitAddress(const Options& options);

    ChildProcess process_;
    int output_;  ///< read end of its standard output
    std::string banner_;
    std::string address_;
};

}  // namespace shapedb
