// The server as a whole: opens the database, loads the index, starts workers and the gRPC
// server, and takes all of it down again in order.
#pragma once

#include <memory>

#include "core/base/error.h"
#include "server/config/server_config.h"
#include "server/ingest/signature_pipeline.h"
#include "server/telemetry/logger.h"

namespace shapedb::rpc {

/// Not thread-safe: one thread starts and drains it.
class Daemon {
  public:
    /// Serves when it returns. Errors: kFileNotWritable (data directory), those of
    /// store::openSqliteStore, kUnavailable (the address cannot be listened on).
    [[nodiscard]] static Result<std::unique_ptr<Daemon>> start(const config::ServerConfig& config,
                                                               telemetry::LoggerPtr log,
                                                               ingest::SignaturePipeline describe);
    /// As `drain`.
    ~Daemon();

    /// Where it listens: the configured host and the port in use.
    [[nodiscard]] const config::Endpoint& endpoint() const;

    /// Health says NOT_SERVING and new calls are refused; running calls may finish within
    /// shutdown.drain_seconds and are cancelled then; jobs go back to the queue; the database
    /// is checkpointed. Idempotent. Errors: of the checkpoint; everything is down all the same.
    Result<void> drain();

  private:
    struct Parts;
    explicit Daemon(std::unique_ptr<Parts> parts);

    std::unique_ptr<Parts> parts_;
};

}  // namespace shapedb::rpc
