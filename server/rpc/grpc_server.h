// The gRPC server: its handlers, its health service, and where it listens.
#pragma once

#include <memory>
#include <string>

#include "core/base/error.h"
#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"
#include "server/catalog/searches.h"
#include "server/config/server_config.h"
#include "server/security/authorization.h"
#include "server/telemetry/audit_log.h"
#include "server/telemetry/logger.h"

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
        telemetry::LoggerPtr log;
        std::string temporaryDirectory;  ///< must exist: backup and restore put their files there
    };
    explicit GrpcServer(Surroundings surroundings);
    /// As `shutDown`.
    ~GrpcServer();

    /// Returns once it serves, at the configured endpoint and Unix socket, with the configured TLS. Call
    /// once. Errors: kUnavailable (cannot listen there), those of TlsCredentials::start.
    [[nodiscard]] Result<void> listen();

    /// Where it listens: the host asked for and the port in use.
    [[nodiscard]] const config::Endpoint& endpoint() const;

    /// Health says NOT_SERVING from now on; calls are still answered.
    void reportNotServing();
    /// Cancels the calls still running and waits for them. Idempotent.
    void shutDown();

  private:
    void startListening();

    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace shapedb::rpc
