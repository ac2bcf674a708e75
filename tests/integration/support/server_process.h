// SPDX-License-Identifier: GPL-3.0-or-later
// Runs shapedbd for a test, in a temporary directory.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/child_process.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::testing {

/// A program that ended by itself.
struct Finished {
    int exitCode = -1;  ///< -1: ended by a signal
    std::string out;
    std::string err;
};

/// Runs shapedbd to its end. `environment` replaces the SHAPEDB_ variables of this process.
[[nodiscard]] Finished runServer(const std::vector<std::string>& arguments,
                                 const std::map<std::string, std::string>& environment = {});

/// A running server on a free port of loopback. Killed when destroyed; a failed test prints its log.
class ServerProcess {
  public:
    /// Starts it with the data directory `directory`/data and waits until it listens; fails the test
    /// when it does not.
    explicit ServerProcess(const std::string& directory, const std::vector<std::string>& flags = {});
    ~ServerProcess();
    ServerProcess(const ServerProcess&) = delete;
    ServerProcess& operator=(const ServerProcess&) = delete;

    [[nodiscard]] const std::string& address() const { return address_; }
    /// What it wrote to standard output until it listened.
    [[nodiscard]] const std::string& banner() const { return banner_; }
    void signal(int number) const;
    [[nodiscard]] bool running() const;
    /// Its exit code; -1 when a signal ended it or the time is over.
    int wait(std::chrono::seconds atMost = std::chrono::seconds(60));
    /// SIGKILL, and waits.
    void kill();
    [[nodiscard]] std::string log() const;

  private:
    std::optional<ShapedbdProcess> server_;
    std::string logFile_;
    std::string address_;
    std::string banner_;
};

[[nodiscard]] std::string readFile(const std::string& path);

}  // namespace shapedb::testing
