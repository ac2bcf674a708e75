// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/limit_table.h"

#include "core/base/error.h"
#include "server/catalog/limits.h"
#include "server/security/key.h"

namespace shapedb::rpc {
namespace {

std::uint64_t ms(std::chrono::milliseconds time) { return static_cast<std::uint64_t>(time.count()); }
std::uint64_t number(int value) { return static_cast<std::uint64_t>(value); }

constexpr const char* kNone = "";

}  // namespace

std::vector<LimitRow> limitTable(const config::ServerConfig& config) {
    using namespace catalog;
    const config::ServerConfig::Limits& limits = config.limits;
    const char* const invalid = errorCodeName(ErrorCode::kInvalidArgument);
    const char* const malformed = errorCodeName(ErrorCode::kMalformedStream);
    const char* const full = errorCodeName(ErrorCode::kQueueFull);
    const char* const cut = errorCodeName(ErrorCode::kDeadlineExceeded);
    return {
        // Names and text.
        {"collection_name_bytes", kMaxCollectionNameBytes, "bytes", "name of a collection or alias", invalid},
        {"description_bytes", kMaxDescriptionBytes, "bytes", "description of a collection", invalid},
        {"key_bytes", kMaxKeyBytes, "bytes", "key of a shape", invalid},
        {"key_prefix_bytes", kMaxKeyBytes, "bytes", "key_prefix of a listing, a count or a change", invalid},
        {"metadata_entries", kMaxMetadataEntries, "entries", "metadata of a shape", invalid},
        {"metadata_removed_keys", kMaxMetadataEntries, "keys", "keys that one change of metadata removes",
         invalid},
        {"metadata_key_bytes", kMaxMetadataKeyBytes, "bytes",
         "key of a metadata entry, also where one is asked for", invalid},
        {"metadata_value_bytes", kMaxMetadataValueBytes, "bytes", "value of a metadata entry", invalid},
        {"filter_bytes", kMaxFilterBytes, "bytes", "filter", errorCodeName(ErrorCode::kMalformedFilter)},
        {"api_key_name_bytes", security::kMaxNameBytes, "bytes", "name of an API key", invalid},
        {"api_key_collections", security::kMaxCollections, "collections", "collections that an API key names",
         invalid},
        // Scans and messages.
        {"min_points", kMinPoints, "points", "points of a scan, at least",
         errorCodeName(ErrorCode::kTooFewPoints)},
        {"limits.max_points", limits.maxPoints, "points", "points of a scan, imported ones included",
         errorCodeName(ErrorCode::kPointLimitExceeded)},
        {"chunk_bytes", kMaxChunkBytes, "bytes", "one PointChunk or BackupChunk", malformed},
        {"message_bytes", number(kMaxReceiveBytes), "bytes",
         "one message to the server; gRPC refuses a larger one with RESOURCE_EXHAUSTED", kNone},
        {"error_message_bytes", kMaxErrorMessageBytes, "bytes", "message of an error, which is cut to this",
         kNone},
        // Searches.
        {"limits.max_k", limits.maxK, "hits", "k of a search, and k times per_group", invalid},
        {"limits.max_batch", limits.maxBatch, "queries", "queries of one SearchBatch", invalid},
        {"per_group", kMaxPerGroup, "hits", "hits of one group", invalid},
        {"verify_candidates", kMostVerified, "candidates", "candidates that one search verifies", invalid},
        {"answer_bytes", kMaxAnswerBytes, "bytes", "answer to a search, a batch or GetShapes", invalid},
        {"requests_bytes", kMaxRequestsBytes, "bytes",
         "memory for decoding messages above 16 KiB, counted as 32 times their size, of all calls together; "
         "blocks of points and backups do not count",
         "queue_full"},
        {"answers_bytes", kMaxAnswersBytes, "bytes",
         "large answers until they are written, of all calls together", full},
        // Listings and changes of many.
        {"keys", kMaxKeys, "keys", "keys that one call names", invalid},
        {"page_size", kMaxPageSize, "shapes", "page of a listing", invalid},
        {"page_bytes", kMaxPageBytes, "bytes", "page of a listing, which ends once it has this many", kNone},
        {"max_values", kMaxValues, "values", "values that CountByValue names", invalid},
        {"different_values", kMaxDifferentValues, "values", "different values that CountByValue counts",
         invalid},
        // Calls at a time.
        {"calls", number(kMaxOrdinaryCalls), "calls", "concurrent calls, without those of administrators",
         full},
        {"admin_calls", number(kMaxAdminCalls), "calls", "calls of AdminService at a time", full},
        {"long_admin_calls", number(kMaxLongAdminCalls), "calls",
         "of them, rebuilds, checks, backups, restores, exports and imports", full},
        {"followers", number(kMaxFollowers), "calls", "calls at a time that wait for a shape or a rebuild",
         full},
        {"copies", number(kMaxCopies), "calls", "backups, restores, exports and imports in transit", full},
        {"limits.max_uploads", number(limits.maxUploads), "calls", "uploads at a time", full},
        {"limits.max_upload_bytes", limits.maxUploadBytes, "bytes",
         "points that all uploads in progress hold", full},
        // Connections.
        {"limits.max_connections", limits.maxConnections, "connections",
         "network connections; more are closed at once", kNone},
        {"local_connections", kMaxLocalConnections, "connections",
         "connections at the Unix socket; more are closed at once", kNone},
        {"streams_of_connection", number(kMaxStreamsOfConnection), "calls",
         "calls at a time in one connection; more wait in the client", kNone},
        {"transport_bytes", kTransportBytes, "bytes",
         "connections and messages in transit, all together; beyond it gRPC reads no more until there is "
         "room",
         kNone},
        {"handshake_milliseconds", ms(kHandshakeTime), "ms",
         "time for a new connection to complete its handshake; then it is closed", kNone},
        {"limits.idle_seconds", number(limits.idleSeconds), "s",
         "time of a connection without calls; then it is closed", kNone},
        {"limits.stall_seconds", number(limits.stallSeconds), "s", "time that a stream may stand still", cut},
        {"limits.min_bytes_per_second", limits.minBytesPerSecond, "bytes/s",
         "speed of a stream in the long run, at least; 0: any", cut},
        // The queue.
        {"ingest.max_queued_jobs", config.ingest.maxQueuedJobs, "scans",
         "scans that wait for segmentation; imports and restores are not limited", full},
        {"ingest.max_queued_bytes", config.ingest.maxQueuedBytes, "bytes", "points of these scans", full},
        {"ingest.max_attempts", number(config.ingest.maxAttempts), "crashes",
         "crashes of the server over one scan, which then is FAILED", kNone},
    };
}

}  // namespace shapedb::rpc
