// A shapedbd of its own in a data directory of its own.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include <sys/types.h>

namespace shapedb::testing {

/// A directory that is gone with this object.
class TemporaryDirectory {
  public:
    TemporaryDirectory();
    ~TemporaryDirectory();
    TemporaryDirectory(const TemporaryDirectory&) = delete;
    TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }

  private:
    std::string path_;
};

/// What a program that ended by itself left behind.
struct Finished {
    int exitCode = -1;  ///< -1: ended by a signal
    std::string out;
    std::string err;
};

/// Runs shapedbd to its end. `environment` replaces the SHAPEDB_ variables of this process.
[[nodiscard]] Finished runServer(const std::vector<std::string>& arguments,
                                 const std::map<std::string, std::string>& environment = {});

/// A running server on a free port of loopback. Killed when destroyed.
class ServerProcess {
  public:
    /// Starts it on `directory` and waits until it listens; fails the test when it does not.
    ServerProcess(const std::string& directory, const std::vector<std::string>& arguments = {});
    ~ServerProcess();
    ServerProcess(const ServerProcess&) = delete;
    ServerProcess& operator=(const ServerProcess&) = delete;

    [[nodiscard]] const std::string& address() const { return address_; }
    /// All lines it wrote to standard output before it said where it listens, that one included.
    [[nodiscard]] const std::string& banner() const { return banner_; }
    void signal(int number) const;
    [[nodiscard]] bool running() const;
    /// Waits for the end; -1 when a signal ended it or the time is over.
    int wait(std::chrono::seconds atMost = std::chrono::seconds(60));
    /// SIGKILL, and waits.
    void kill();
    [[nodiscard]] std::string log() const;

  private:
    pid_t process_ = -1;
    int output_ = -1;
    std::string logFile_;
    std::string address_;
    std::string banner_;
};

[[nodiscard]] std::string readFile(const std::string& path);

}  // namespace shapedb::testing
