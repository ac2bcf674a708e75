// SPDX-License-Identifier: GPL-3.0-or-later
// The whole server: opens the store, starts the catalog and the transports, and shuts everything down
// again. Which store and which transports there are is decided here and nowhere else.
#pragma once

#include <memory>
#include <optional>

#include "core/base/error.h"
#include "server/config/server_config.h"
#include "server/ingest/signature_pipeline.h"
#include "server/security/keyring.h"
#include "server/telemetry/logger.h"

namespace shapedb {

/// The API keys of the server with this data directory, which may be running. Trouble with them is told in
/// `log`, which may be null. Errors: kFileNotWritable (data directory), those of store::openSqliteKeyStore.
[[nodiscard]] Result<std::unique_ptr<security::Keyring>> openKeyring(const std::string& dataDirectory,
                                                                     const telemetry::LoggerPtr& log);

/// Not thread-safe: one thread starts and drains it.
class Daemon {
  public:
    /// Returns once it serves. Errors: kFileNotWritable (data directory), those of
    /// store::openSqliteStore and openKeyring, kRejected (API keys are required and there is none), those of
    /// GrpcServer::listen and HttpServer::listen.
    [[nodiscard]] static Result<std::unique_ptr<Daemon>> start(const config::ServerConfig& config,
                                                               telemetry::LoggerPtr log,
                                                               ingest::SignaturePipeline pipeline);
    /// As `drain`.
    ~Daemon();

    /// Where it listens: the configured host and the port in use.
    [[nodiscard]] const config::Endpoint& endpoint() const;

    /// The same of HTTP, if it is served.
    [[nodiscard]] std::optional<config::Endpoint> httpEndpoint() const;

    /// Reports NOT_SERVING, refuses new calls, gives running calls shutdown.drain_seconds before it
    /// cancels them, puts jobs back into the queue and checkpoints the database. Idempotent. Errors: of
    /// the checkpoint; everything is down nevertheless.
    Result<void> drain();

  private:
    struct Parts;
    explicit Daemon(std::unique_ptr<Parts> parts);

    std::unique_ptr<Parts> parts_;
};

}  // namespace shapedb
