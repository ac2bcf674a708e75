// SPDX-License-Identifier: GPL-3.0-or-later
// The gRPC server: its handlers, its health service, and where it listens.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"
#include "server/catalog/searches.h"
#include "server/config/server_config.h"
#include "server/rpc/inside.h"
#include "server/rpc/tls_credentials.h"
#include "server/security/authorization.h"
#include "server/telemetry/audit_log.h"
#include "server/telemetry/logger.h"
#include "server/telemetry/metrics.h"

namespace shapedb::rpc {

/// Not thread-safe: one thread starts it and takes it down.
class GrpcServer {
  public:
    /// What its handlers work with. What is given by reference must outlive the server.
    struct Surroundings {
        const config::ServerConfig& config;
        catalog::Catalog& catalog;
        catalog::Admission& admission;
        catalog::Searches& searches;
        const security::AccessPolicy& access;
        telemetry::AuditLog& audit;
        telemetry::Metrics& metrics;
        telemetry::LoggerPtr log;
        std::string temporaryDirectory;        ///< must exist: backup and restore put their files there
        TlsCredentials::AlsoUse alsoUseTls{};  ///< of another transport; may be empty
        /// Whether searches reach all signatures; empty: they always do.
        std::function<bool()> canSearch{};
    };
    explicit GrpcServer(Surroundings surroundings);
    /// As `shutDown`.
    ~GrpcServer();

    /// Returns once it serves, at the configured endpoint and Unix socket, with the configured TLS. Call
    /// once. Errors: kUnavailable (cannot listen there), those of TlsCredentials::start.
    [[nodiscard]] Result<void> listen();

    /// Where it listens: the host asked for and the port in use.
    [[nodiscard]] const config::Endpoint& endpoint() const;

    /// How it is doing. From any thread between `listen` and `shutDown`.
    struct State {
        std::size_t connections = 0;
        std::uint64_t connectionsRefused = 0;  ///< since start
        bool accepting = true;                 ///< false: connections cannot be accepted
        std::optional<security::UnixMs> certificateExpires;
    };
    [[nodiscard]] State state() const;

    /// What health says, from any thread between `listen` and `shutDown`.
    [[nodiscard]] bool serving() const;
    /// How other transports of this process call the handlers, after `listen`. Their calls end, or are
    /// cancelled, before `shutDown`.
    [[nodiscard]] Inside inside() const;

    /// A listener of another transport cannot accept connections (false), or can again: health tells it as of
    /// the own ones. From any thread between `listen` and `shutDown`.
    void reportAccepting(bool accepting);
    /// Health says NOT_SERVING from now on; calls are still answered.
    void reportNotServing();
    /// Cancels the calls still running and waits for them. Idempotent.
    void shutDown();

  private:
    Result<void> build(const std::shared_ptr<grpc::ServerCredentials>& credentials);
    void startListening();

    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace shapedb::rpc
