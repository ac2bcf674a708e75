// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/put_rules.h"

#include "core/base/return_if_error.h"
#include "server/store/failure.h"

namespace shapedb::store {

Result<PutOutcome> decidePut(const PutRequest& request, const std::string& collectionName,
                             const Shape* existing) {
    const bool samePoints = existing != nullptr && existing->checksum == request.scan.checksum() &&
                            existing->origin == request.scan.origin();
    const Metadata before = existing != nullptr ? existing->metadata : Metadata();
    const Metadata after = request.metadata.of(before);
    if (request.checkMetadata) RETURN_IF_ERROR(request.checkMetadata(after));
    const bool identical = samePoints && after == before;
    if (existing == nullptr && request.mode == PutMode::kUpdateOnly) {
        return fail(noSuchShape(collectionName, request.key));
    }
    if (existing != nullptr && request.mode == PutMode::kInsertOnly && !identical) {
        return fail(ErrorCode::kAlreadyExists, "shape " + quoted(request.key) +
                                                   " already exists in collection " + quoted(collectionName) +
                                                   " with other points or metadata");
    }
    if (existing != nullptr && request.mode == PutMode::kSamePoints && !samePoints) {
        return fail(ErrorCode::kAlreadyExists, "shape " + quoted(request.key) +
                                                   " already exists in collection " + quoted(collectionName) +
                                                   " with other points");
    }
    const std::int64_t version = existing != nullptr ? existing->version : 0;
    // Done before, and the client did not hear of it.
    const bool repeated = identical && request.expectedVersion == version - 1;
    if (!repeated) RETURN_IF_ERROR(requireVersion(request.key, version, request.expectedVersion));
    if (existing == nullptr) return PutOutcome::kCreated;
    if (samePoints && existing->state == ShapeState::kFailed) return PutOutcome::kRetried;
    if (identical) return PutOutcome::kUnchanged;
    return samePoints ? PutOutcome::kMetadataChanged : PutOutcome::kReplaced;
}

Result<void> requireVersion(const std::string& key, std::int64_t actual,
                            std::optional<std::int64_t> expected) {
    if (!expected || *expected == actual) return {};
    const std::string is =
        actual == 0 ? "does not exist (version 0)" : "has version " + std::to_string(actual);
    return fail(ErrorCode::kVersionConflict, "shape " + quoted(key) + " " + is +
                                                 ", not the expected version " + std::to_string(*expected));
}

Result<void> requireRoom(std::uint64_t bytes, std::uint64_t maxQueuedJobs, std::uint64_t maxQueuedBytes,
                         const QueueDepth& others) {
    if (maxQueuedJobs > 0 && others.jobs >= maxQueuedJobs) {
        return fail(ErrorCode::kQueueFull, "the ingest queue is full (" + std::to_string(others.jobs) +
                                               " of " + std::to_string(maxQueuedJobs) +
                                               " scans, ingest.max_queued_jobs); retry later");
    }
    if (maxQueuedBytes > 0 && others.bytes + bytes > maxQueuedBytes) {
        return fail(ErrorCode::kQueueFull, "the ingest queue has no room for " + std::to_string(bytes) +
                                               " more bytes (" + std::to_string(others.bytes) + " of " +
                                               std::to_string(maxQueuedBytes) +
                                               " bytes taken, ingest.max_queued_bytes); retry later");
    }
    return {};
}

Error noSuchShape(const std::string& collectionName, const std::string& key) {
    return {ErrorCode::kNotFound,
            "there is no shape " + quoted(key) + " in collection " + quoted(collectionName)};
}

}  // namespace shapedb::store
