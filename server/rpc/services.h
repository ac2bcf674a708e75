// SPDX-License-Identifier: GPL-3.0-or-later
// What the gRPC handlers work with.
#pragma once

#include <chrono>
#include <string>

#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"
#include "server/catalog/searches.h"
#include "server/config/server_config.h"
#include "server/rpc/cancel_watcher.h"
#include "server/security/authorization.h"
#include "server/telemetry/audit_log.h"
#include "server/telemetry/logger.h"
#include "server/telemetry/metrics.h"

namespace shapedb::rpc {

/// References to parts of the daemon, which outlives all handlers. Each member is thread-safe.
struct Services {
    const config::ServerConfig& config;
    catalog::Catalog& catalog;
    catalog::Admission& admission;
    CancelWatcher& cancellations;
    catalog::Searches& searches;
    const security::AccessPolicy& access;
    telemetry::AuditLog& audit;
    telemetry::Metrics& metrics;
    telemetry::LoggerPtr log;
    std::string temporaryDirectory;  ///< exists; for backup and restore files
    std::chrono::system_clock::time_point started;
    std::string insideSecret;  ///< what calls of other transports of this process show (inside.h)
};

}  // namespace shapedb::rpc
