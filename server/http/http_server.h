// SPDX-License-Identifier: GPL-3.0-or-later
// The HTTP server: where it listens, its threads and its connections. Requests go to the gRPC
// server's handlers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "core/base/error.h"
#include "server/config/server_config.h"
#include "server/rpc/inside.h"
#include "server/security/certificate.h"
#include "server/telemetry/logger.h"

namespace shapedb::http {

/// One thread starts it and takes it down.
class HttpServer {
  public:
    /// `config` must outlive the server.
    HttpServer(const config::ServerConfig& config, telemetry::LoggerPtr log);
    /// As `shutDown`.
    ~HttpServer();

    /// The certificate of new connections, from now on. Before `listen` if there is to be TLS. From any
    /// thread. Errors: those of makeTlsContext; the old one stays in use.
    Result<void> useTls(const security::TlsIdentity& identity);

    /// Returns once it serves at http.listen; does nothing if that is empty. `inside` leads to a gRPC server
    /// that serves until `shutDown` has returned; `serving` says how it is doing, from any thread.
    /// `onAccepting` is told, by a thread of the listener, when connections cannot be accepted (false) and
    /// when they can again. Call once. Errors: those of net::Listener::open.
    [[nodiscard]] Result<void> listen(rpc::Inside inside, std::function<bool()> serving,
                                      std::function<void(bool)> onAccepting);

    /// Where it listens: the host asked for and the port in use.
    [[nodiscard]] const config::Endpoint& endpoint() const;

    /// From any thread between `listen` and `shutDown`.
    struct State {
        std::size_t connections = 0;
        std::uint64_t connectionsRefused = 0;  ///< since start
        bool accepting = true;
    };
    [[nodiscard]] State state() const;

    /// Takes no new connections; those that are open close after the answer that they wait for.
    void drain();
    /// `drain`; cancels the calls still running after a moment, and waits for them. Idempotent.
    void shutDown();

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace shapedb::http
