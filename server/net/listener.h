// SPDX-License-Identifier: GPL-3.0-or-later
// Accepts connections and hands them over. gRPC's own listener gives up for good when a single accept fails,
// and takes connections without end; this one does neither.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "core/base/error.h"
#include "server/config/server_config.h"
#include "server/net/connections.h"

namespace shapedb::net {

/// What a listener does and tells while it runs; called from its thread, must not throw.
struct ListenerEvents {
    /// A new connection: a non-blocking socket that the callee closes.
    std::function<void(int socket)> onConnection;
    /// Connections could not be accepted (`problem` says why), or can be again (empty).
    std::function<void(const std::string& problem)> onProblem;
    /// The first of a series of connections that were closed at once because there are too many.
    std::function<void(std::size_t open)> onTooMany;
};

/// Not thread-safe, except for the counters.
class Listener {
  public:
    Listener() = default;
    /// As `stop`.
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// Binds to every address of the host. Port 0 picks a free one. Call once. Errors: kUnavailable (the host
    /// is unknown, the address is in use, does not belong to this machine or is not permitted; a name of
    /// loopback leads elsewhere).
    [[nodiscard]] Result<void> open(const config::Endpoint& endpoint);
    /// Binds to a Unix socket that only its owner can connect to (mode 0700). A socket that nobody listens at
    /// any more is replaced; this one is removed by the destructor. Call once, instead of `open`. Errors:
    /// kUnavailable (somebody listens there, something else has the name, the path is longer than 107 bytes,
    /// the folder does not take it).
    [[nodiscard]] Result<void> openUnix(const std::string& path);
    /// Where it listens: the host asked for and the port in use; of a Unix socket nothing.
    [[nodiscard]] const config::Endpoint& endpoint() const { return endpoint_; }

    /// Starts to accept, at most `maxConnections` at a time; more are closed at once, so that their clients
    /// hear of it. After `open`, once.
    void start(std::size_t maxConnections, ListenerEvents events);
    /// Accepts no more. Connections that were handed over stay open. Idempotent.
    void stop();

    /// Connections that were closed at once, since the start.
    [[nodiscard]] std::uint64_t refused() const { return refused_.load(); }
    /// Open connections, as of the last that came or went within a second.
    [[nodiscard]] std::size_t connections() const { return connections_.load(); }

  private:
    void run();
    Result<void> makeEvents(const std::string& where);
    /// False when there is trouble: `errno` says which.
    bool acceptAll(int listening);
    void handOver(int socket);
    void reportProblem(const std::string& problem);

    config::Endpoint endpoint_;
    std::string unixPath_;  ///< to remove; empty: none
    ino_t unixInode_ = 0;   ///< of it, as we made it
    dev_t unixDevice_ = 0;
    std::vector<int> listening_;
    int wake_ = -1;   ///< eventfd that ends the thread
    int spare_ = -1;  ///< given up to tell a client that there are no descriptors left
    std::size_t maxConnections_ = 0;
    ListenerEvents events_;
    std::atomic<std::uint64_t> refused_{0};
    std::atomic<std::size_t> connections_{0};
    Connections open_;           ///< used by the thread only
    bool inTrouble_ = false;     ///< used by the thread only
    bool overCapacity_ = false;  ///< used by the thread only
    std::thread thread_;
};

}  // namespace shapedb::net
