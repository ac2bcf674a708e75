// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/server_samples.h"

#include <sys/statvfs.h>

#include "server/config/load.h"

namespace shapedb {
namespace {

using telemetry::Sample;
constexpr Sample::Kind kGauge = Sample::Kind::kGauge;
constexpr Sample::Kind kCounter = Sample::Kind::kCounter;

double number(std::uint64_t value) { return static_cast<double>(value); }

void append(std::vector<Sample>& samples, std::vector<Sample> more) {
    samples.insert(samples.end(), more.begin(), more.end());
}

std::vector<Sample> sampleContent(catalog::Catalog& catalog) {
    const auto stats = catalog.recentStats();
    if (!stats) return {};
    const store::StoreStats& stored = stats->store;
    const char* shapes = "Shapes, by state.";
    return {
        {"shapedb_collections", "Collections.", kGauge, number(stored.collections)},
        {"shapedb_shapes", shapes, kGauge, number(stored.shapesPending), {{"state", "pending"}}},
        {"shapedb_shapes", shapes, kGauge, number(stored.shapesReady), {{"state", "ready"}}},
        {"shapedb_shapes", shapes, kGauge, number(stored.shapesFailed), {{"state", "failed"}}},
        {"shapedb_queue_scans", "Scans that wait for segmentation.", kGauge, number(stats->queued)},
        {"shapedb_queue_point_bytes", "Bytes of points that wait or are being segmented.", kGauge,
         number(stats->queue.bytes)},
        {"shapedb_segmenting_scans", "Scans being segmented.", kGauge, number(stats->running)},
        {"shapedb_segmented_scans_total", "Uploaded scans segmented since the start.", kCounter,
         number(stats->ingested)},
        {"shapedb_index_signatures", "Signatures in memory, which searches read.", kGauge,
         number(stats->index.signatures)},
        {"shapedb_index_bytes", "Memory of these signatures.", kGauge, number(stats->index.bytes)},
        {"shapedb_database_bytes", "Size of the database file.", kGauge, number(stored.databaseBytes)},
        {"shapedb_database_log_bytes", "Size of its write-ahead log.", kGauge, number(stored.walBytes)},
        {"shapedb_stored_point_bytes", "Compressed points in the database.", kGauge,
         number(stored.storedPointBytes)},
        {"shapedb_missing_commits", "Acknowledged changes that were gone when the server started.", kGauge,
         number(stored.missingCommits)},
        {"shapedb_unacknowledged_notices", "Notices that changes are or may be missing, not acknowledged.",
         kGauge, number(stored.notices)},
        {"shapedb_build_info",
         "Always 1; the labels tell the version and the database's schema.",
         kGauge,
         1.0,
         {{"version", config::version()}, {"schema", std::to_string(stored.schemaVersion)}}},
    };
}

/// Also when the database cannot be read.
std::vector<Sample> sampleCondition(const catalog::Catalog& catalog) {
    const catalog::Condition condition = catalog.condition();
    return {
        {"shapedb_damaged_collections",
         "Collections that cannot be searched because their stored data is damaged.", kGauge,
         number(condition.damagedCollections)},
        {"shapedb_segmentation_in_service",
         "1, or 0 while scans are refused because the stored queue is damaged.", kGauge,
         condition.segmentation ? 1.0 : 0.0},
        {"shapedb_content_in_service", "1, or 0 while a restore replaces the collections.", kGauge,
         condition.content ? 1.0 : 0.0},
    };
}

std::vector<Sample> sampleCalls(const SampleSources& sources) {
    const catalog::CallCounts running = sources.admission.calls.running();
    const rpc::GrpcServer::State state = sources.grpc.state();
    const http::HttpServer::State http = sources.http.state();
    const char* calls = "Running calls, by kind; uploads also count as ordinary.";
    std::vector<Sample> samples = {
        {"shapedb_calls_running", calls, kGauge, number(running.ordinary), {{"kind", "ordinary"}}},
        {"shapedb_calls_running", calls, kGauge, number(running.uploads), {{"kind", "upload"}}},
        {"shapedb_calls_running", calls, kGauge, number(running.admin), {{"kind", "admin"}}},
        {"shapedb_searches_total", "Searches answered since the start.", kCounter,
         number(sources.searches.count())},
        {"shapedb_connections", "Open network connections.", kGauge,
         number(state.connections + http.connections)},
        {"shapedb_connections_refused_total", "Connections closed at once because there were too many.",
         kCounter, number(state.connectionsRefused + http.connectionsRefused)},
        {"shapedb_accepting_connections", "1, or 0 while connections cannot be accepted.", kGauge,
         state.accepting && http.accepting ? 1.0 : 0.0},
    };
    if (state.certificateExpires) {
        samples.push_back({"shapedb_tls_certificate_expiry_timestamp_seconds",
                           "When the TLS certificate in use expires, since 1970 (UTC).", kGauge,
                           static_cast<double>(*state.certificateExpires) / 1e3});
    }
    return samples;
}

std::vector<Sample> sampleShards(const cluster::Member::State& state) {
    const char* shards = "Shards of the cluster: held by this server, to be held by it, held by none.";
    return {
        {"shapedb_shards", shards, kGauge, number(state.held), {{"state", "held"}}},
        {"shapedb_shards", shards, kGauge, number(state.wanted), {{"state", "wanted"}}},
        {"shapedb_shards", shards, kGauge, number(state.uncovered), {{"state", "uncovered"}}},
        {"shapedb_shards_follow_changes", "1, or 0 while the database cannot be read.", kGauge,
         state.following ? 1.0 : 0.0},
    };
}

std::vector<Sample> sampleDisk(const std::string& directory) {
    struct statvfs status {};
    if (::statvfs(directory.c_str(), &status) != 0) return {};
    const double free = static_cast<double>(status.f_bavail) * static_cast<double>(status.f_frsize);
    return {{"shapedb_data_free_bytes", "Free space where the data directory is.", kGauge, free}};
}

}  // namespace

std::vector<Sample> sampleServer(const SampleSources& sources) {
    std::vector<Sample> samples = sampleContent(sources.catalog);
    if (sources.shards) append(samples, sampleShards(*sources.shards));
    append(samples, sampleCondition(sources.catalog));
    append(samples, sampleCalls(sources));
    append(samples, sampleDisk(sources.dataDirectory));
    append(samples, telemetry::sampleProcess(sources.started));
    return samples;
}

}  // namespace shapedb
