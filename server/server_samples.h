// SPDX-License-Identifier: GPL-3.0-or-later
// What the whole server tells of itself whenever Prometheus asks.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"
#include "server/catalog/search_runner.h"
#include "server/cluster/member.h"
#include "server/http/http_server.h"
#include "server/rpc/grpc_server.h"
#include "server/telemetry/metrics.h"

namespace shapedb {

/// Where the numbers come from. Each outlives the metrics and is thread-safe.
struct SampleSources {
    catalog::Catalog& catalog;
    catalog::Admission& admission;
    const catalog::SearchRunner& searches;
    const rpc::GrpcServer& grpc;
    const http::HttpServer& http;
    const std::string& dataDirectory;
    std::chrono::system_clock::time_point started;
    std::optional<cluster::Member::State> shards{};  ///< of a member of a cluster
};

/// What cannot be told at the moment, as while the database is replaced, is left out; samples of one name
/// follow one another.
[[nodiscard]] std::vector<telemetry::Sample> sampleServer(const SampleSources& sources);

}  // namespace shapedb
