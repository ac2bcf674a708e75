// SPDX-License-Identifier: GPL-3.0-or-later
// Checks of settings against each other.
#include <utility>

#include "core/base/return_if_error.h"
#include "server/config/settings.h"

namespace shapedb::config {
namespace {

/// Whether others than this machine reach it.
bool isBeyond(const std::string& address) {
    if (address.empty()) return false;
    const auto endpoint = parseEndpoint(address);
    return !endpoint || !endpoint->isLoopback();
}

/// The setting of an address of the API that is beyond this machine, with its value; empty: there is none.
std::string addressBeyond(const ServerConfig& config) {
    const std::pair<const char*, const std::string&> addresses[] = {{"listen", config.listen},
                                                                    {"http.listen", config.http.listen}};
    for (const auto& [key, address] : addresses)
        if (isBeyond(address)) return std::string(key) + " = " + address;
    return {};
}

/// Prometheus reads without TLS and without a key.
Result<void> validateMetrics(const ServerConfig& config) {
    const bool open = config.metrics.anyoneMayRead == "yes" || config.security.anyoneMayDoAll == "yes";
    if (open || !isBeyond(config.metrics.listen)) return {};
    return fail(ErrorCode::kInvalidArgument,
                "metrics.listen = " + config.metrics.listen +
                    " is beyond this machine, and metrics are served without TLS and without a key; let a "
                    "proxy with both stand before it, or, for a network where anybody may read them, set " +
                    kMetricsForAnyone + " = yes");
}

Result<void> validateStore(const ServerConfig& config) {
    const bool postgres = config.store.engine == "postgres";
    if (postgres && config.postgres.uri.empty()) {
        return fail(ErrorCode::kInvalidArgument, "store.engine = postgres requires postgres.uri");
    }
    if (!postgres && !config.postgres.uri.empty()) {
        return fail(ErrorCode::kInvalidArgument, "postgres.uri requires store.engine = postgres");
    }
    return {};
}

Result<void> validateCluster(const ServerConfig& config) {
    const ServerConfig::Cluster& cluster = config.cluster;
    const bool shared = config.store.engine == "postgres";
    if (!shared && config.role != "all") {
        return fail(ErrorCode::kInvalidArgument,
                    "role = " + config.role + " requires store.engine = postgres");
    }
    if (!shared && cluster.replicas > 0) {
        return fail(ErrorCode::kInvalidArgument, "cluster.replicas requires store.engine = postgres");
    }
    const bool tls = !cluster.certificate.empty();
    if (tls != !cluster.key.empty() || tls != !cluster.ca.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "cluster.certificate, cluster.key and cluster.ca belong together: set all or none");
    }
    if (cluster.replicas == 0) return {};
    if (cluster.listen.empty()) {
        return fail(ErrorCode::kInvalidArgument, "cluster.replicas requires cluster.listen");
    }
    const auto endpoint = parseEndpoint(cluster.listen);
    const bool isAnyAddress = endpoint && (endpoint->host == "0.0.0.0" || endpoint->host == "::");
    if (isAnyAddress && cluster.advertise.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "cluster.listen = " + cluster.listen +
                        " is not an address that other servers can reach: set cluster.advertise");
    }
    if (tls || !isBeyond(cluster.listen) || config.security.anyoneMayDoAll == "yes") return {};
    return fail(ErrorCode::kInvalidArgument,
                "cluster.listen = " + cluster.listen +
                    " can be reached from other machines, and whoever connects there can read every "
                    "collection: it requires cluster.certificate, cluster.key and cluster.ca");
}

/// What must not be reachable beyond this machine without TLS.
Result<void> validateSecurity(const ServerConfig& config) {
    const bool tls = !config.tls.certificate.empty();
    if (tls != !config.tls.key.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "tls.certificate and tls.key belong together: set both or neither");
    }
    if (!tls && !config.tls.clientCa.empty()) {
        return fail(ErrorCode::kInvalidArgument, "tls.client_ca requires tls.certificate and tls.key");
    }
    RETURN_IF_ERROR(validateMetrics(config));
    if (tls || config.security.anyoneMayDoAll == "yes") return {};
    const std::string beyond = addressBeyond(config);
    if (beyond.empty()) return {};
    return fail(ErrorCode::kInvalidArgument,
                beyond +
                    " can be reached from other machines, which requires TLS (tls.certificate, tls.key) and "
                    "API keys (shapedbd key create); see docs/security.md. For a network where everybody may "
                    "do everything set " +
                    kAnyoneMayDoAll + " = yes");
}

}  // namespace

bool keysRequired(const ServerConfig& config) {
    if (config.security.keys == "always") return true;
    return !addressBeyond(config).empty() && config.security.anyoneMayDoAll == "no";
}

Result<void> validateTogether(const ServerConfig& config) {
    RETURN_IF_ERROR(validateSecurity(config));
    RETURN_IF_ERROR(validateStore(config));
    RETURN_IF_ERROR(validateCluster(config));
    const std::uint64_t scan = config.limits.maxPoints * 12;
    const auto tooSmall = [&](const char* key) {
        return fail(ErrorCode::kInvalidArgument,
                    std::string(key) + " is smaller than one scan of limits.max_points (" +
                        std::to_string(config.limits.maxPoints) + " points, " + std::to_string(scan) +
                        " bytes): raise it or lower limits.max_points");
    };
    if (config.limits.maxUploadBytes < scan) return tooSmall("limits.max_upload_bytes");
    if (config.ingest.maxQueuedBytes < scan) return tooSmall("ingest.max_queued_bytes");
    return {};
}

}  // namespace shapedb::config
