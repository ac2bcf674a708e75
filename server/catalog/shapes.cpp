// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes: look up, put, delete, follow, describe.
#include <utility>

#include "core/base/return_if_error.h"
#include "core/search/candidates.h"
#include "core/signature/signature_codec.h"
#include "server/catalog/catalog.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"

namespace shapedb::catalog {

// Looking up -----------------------------------------------------------------------------

Result<FoundShape> Catalog::findShape(const index::SnapshotPtr& collection, const std::string& key) {
    RETURN_IF_ERROR(checkKey(key));
    auto shape = store_->getShape(collection->collection.id, key);
    if (!shape && shape.error().code == ErrorCode::kNotFound) {
        return fail(ErrorCode::kNotFound,
                    "there is no shape '" + key + "' in collection '" + collection->collection.name + "'");
    }
    RETURN_IF_ERROR(shape);
    return FoundShape{collection, std::move(*shape), std::nullopt};
}

Result<store::Shape> Catalog::shapeById(std::int64_t shapeId) { return store_->getShapeById(shapeId); }

Result<std::vector<std::optional<store::Shape>>> Catalog::getShapes(std::int64_t collectionId,
                                                                    const std::vector<std::string>& keys) {
    return store_->getShapes(collectionId, keys);
}

Result<std::vector<store::Shape>> Catalog::listShapes(std::int64_t collectionId,
                                                      const store::ShapeListing& listing, std::size_t limit,
                                                      const store::ShapeFilter& filter) {
    return store_->listShapes(collectionId, listing, limit, filter);
}

Result<std::uint64_t> Catalog::countShapes(std::int64_t collectionId, const store::ShapeFilter& filter) {
    return store_->countShapes(collectionId, filter);
}

Result<Signature> Catalog::signature(FoundShape& found) {
    const bool here = index_.where() == index::Signatures::kHere;
    while (!here || found.collection->signatures.find(found.shape.id)) {
        const auto row = store_->getSignature(found.shape.id);
        // Only the store knows which shapes have one.
        if (!here && !row && row.error().code == ErrorCode::kNotReady) break;
        auto signature = decoded(*found.collection, row);
        if (signature || signature.error().code != ErrorCode::kNotReady) return signature;
        // The store may have switched to the results of a rebuild: once the index has followed, again with
        // them.
        const store::Collection& collection = found.collection->collection;
        const auto now = followed(collection);
        RETURN_IF_ERROR(now);
        if (!*now) return signature;
        found.collection = *now;
    }
    const std::string name = "shape '" + found.shape.key + "' has no signature";
    if (found.shape.failure) {
        return fail(ErrorCode::kNotReady, name + ": it cannot be segmented: " + found.shape.failure->message);
    }
    return fail(ErrorCode::kNotReady, name + " yet: wait until it is ready");
}

/// The collection after a rebuild that was put in place; null if there was none.
Result<index::SnapshotPtr> Catalog::followed(const store::Collection& collection) {
    if (store_->isShared()) RETURN_IF_ERROR(follower_.follow());
    if (index_.whileGeneration(collection.id, collection.generation, [] {})) return index::SnapshotPtr();
    auto now = index_.byId(collection.id);
    RETURN_IF_ERROR(now);
    if ((*now)->collection.generation == collection.generation) return index::SnapshotPtr();
    return now;
}

Result<std::vector<std::optional<store::StoredHit>>> Catalog::getHits(
    const std::vector<std::int64_t>& shapeIds, bool withSignatures) {
    return store_->getHits(shapeIds, withSignatures);
}

Result<Signature> Catalog::decoded(const index::Snapshot& searched, const Result<store::SignatureRow>& row) {
    RETURN_IF_ERROR(row);
    if (row->generation != searched.collection.generation) {
        return fail(ErrorCode::kNotReady, "a rebuild of collection '" + searched.collection.name +
                                              "' is being put in place: try again");
    }
    auto signature = decodeSignature(row->bytes);
    if (!signature) {
        return fail(ErrorCode::kDataLoss, "the signature of shape " + std::to_string(row->shapeId) +
                                              " is damaged: " + signature.error().message);
    }
    return signature;
}

std::vector<std::optional<double>> Catalog::qualities(const index::Snapshot& collection,
                                                      const std::vector<std::int64_t>& shapeIds) const {
    std::vector<std::optional<double>> all(shapeIds.size());
    if (index_.where() == index::Signatures::kHere) {
        for (std::size_t i = 0; i < shapeIds.size(); ++i) {
            const SignatureSet::Place place = collection.signatures.find(shapeIds[i]);
            if (place) all[i] = qualityOf(*place.block, place.row);
        }
        return all;
    }
    const auto stored = store_->getHits(shapeIds, true);
    if (!stored) return all;
    for (std::size_t i = 0; i < shapeIds.size(); ++i) {
        if (!(*stored)[i]) continue;
        const auto signature = decoded(collection, (*stored)[i]->signature);
        if (signature && signature->attributes) all[i] = signature->attributes->quality / 255.0;
    }
    return all;
}

std::optional<double> Catalog::servingQuality(const store::Shape& shape) const {
    const auto collection = index_.byId(shape.collectionId);
    return collection ? quality(**collection, shape.id) : std::nullopt;
}

// Changing -------------------------------------------------------------------------------

Result<void> Catalog::admitUpload(const ShapeHeader& header) const {
    RETURN_IF_ERROR(checkKey(header.key));
    RETURN_IF_ERROR(checkMetadataChange(header.metadata));
    RETURN_IF_ERROR(checkExpectedVersion(header.expectedVersion));
    const auto found = collection(header.collection);
    RETURN_IF_ERROR(found);
    RETURN_IF_ERROR(requireIngest(**found));
    return restores_.requireNoRestore();
}

Result<void> Catalog::requireIngest(const index::Snapshot& collection) const {
    RETURN_IF_ERROR(collection.requireParameters());
    if (auto trouble = workers_.trouble()) return fail(std::move(*trouble));
    return {};
}

Result<AddedShape> Catalog::put(const ShapeHeader& header, store::VerifiedScan scan) {
    const RestoreGate::Write write(restores_);
    // Looked up under the gate: while the points arrived the collection may have been deleted, or
    // replaced by a restore.
    const auto found = collection(header.collection);
    RETURN_IF_ERROR(found);
    RETURN_IF_ERROR(requireIngest(**found));
    store::PutRequest request(std::move(scan));
    request.collectionId = (*found)->collection.id;
    request.key = header.key;
    request.mode = header.mode;
    request.expectedVersion = header.expectedVersion;
    request.metadata = header.metadata;
    request.checkMetadata = checkMetadata;
    request.maxQueuedJobs = options_.maxQueuedJobs;
    request.maxQueuedBytes = options_.maxQueuedBytes;
    auto put = store_->putShape(request);
    RETURN_IF_ERROR(put);
    const store::Shape& shape = put->shape;
    switch (put->outcome) {
        case store::PutOutcome::kCreated: workers_.wake(); break;
        case store::PutOutcome::kReplaced:
            // The old signature serves until the new one is there, but with the new metadata.
            workers_.supersede(shape.id, shape.pointsVersion);
            workers_.wake();
            refreshOrLog(shape, "new metadata is not searched yet");
            break;
        case store::PutOutcome::kRetried: workers_.wake(); break;
        case store::PutOutcome::kMetadataChanged:
            refreshOrLog(shape, "new metadata is not searched yet");
            break;
        case store::PutOutcome::kUnchanged: break;
    }
    return AddedShape{put->outcome, std::move(put->shape), (*found)->collection.name};
}

std::chrono::milliseconds Catalog::retryAfterQueueFull() {
    const auto depth = store_->queueDepth();
    return workers_.retryAfter(depth ? depth->jobs : 0);
}

Result<FoundShape> Catalog::deleteShape(const std::string& collectionName, const std::string& key,
                                        std::optional<std::int64_t> expectedVersion) {
    const RestoreGate::Write write(restores_);
    const auto found = collection(collectionName);
    RETURN_IF_ERROR(found);
    RETURN_IF_ERROR(checkKey(key));
    const bool here = index_.where() == index::Signatures::kHere;
    std::optional<double> before;
    if (!here) {
        const auto now = store_->getShape((*found)->collection.id, key);
        if (now) before = quality(**found, now->id);
    }
    auto shape = store_->deleteShape((*found)->collection.id, key, expectedVersion);
    RETURN_IF_ERROR(shape);
    if (here) before = quality(**found, shape->id);
    workers_.supersede(shape->id);
    // Wakes those who follow it, to find that it is gone.
    board_.settled(shape->id);
    refreshOrLog(*shape, "deleted shape is still searched");
    return FoundShape{*found, std::move(*shape), before};
}

void Catalog::refreshOrLog(const store::Shape& shape, const char* consequence) {
    const auto refreshed = index_.refresh(shape.collectionId, shape.id);
    if (!refreshed) log_->error(consequence, telemetry::fieldsOf(refreshed.error()));
}

void Catalog::refreshOrLog(const std::vector<store::Shape>& shapes, const char* consequence) {
    if (shapes.empty()) return;
    std::vector<std::int64_t> ids;
    for (const store::Shape& shape : shapes) ids.push_back(shape.id);
    const auto refreshed = index_.refresh(shapes.front().collectionId, ids);
    if (!refreshed) log_->error(consequence, telemetry::fieldsOf(refreshed.error()));
}

Result<void> Catalog::requireEpoch(std::uint64_t epoch) const {
    if (restores_.epoch() == epoch) return {};
    return fail(ErrorCode::kUnavailable,
                "the database was replaced by a backup while the call ran: repeat it");
}

Result<std::vector<store::Shape>> Catalog::deleteShapes(
    std::uint64_t epoch, const std::vector<std::int64_t>& shapeIds,
    const std::function<bool(const store::Shape&)>& still) {
    const RestoreGate::Write write(restores_);
    RETURN_IF_ERROR(requireEpoch(epoch));
    auto deleted = store_->deleteShapes(shapeIds, still);
    RETURN_IF_ERROR(deleted);
    for (const store::Shape& shape : *deleted) {
        workers_.supersede(shape.id);
        // Wakes those who follow it, to find that it is gone.
        board_.settled(shape.id);
    }
    refreshOrLog(*deleted, "deleted shapes are still searched");
    return deleted;
}

Result<std::vector<store::Shape>> Catalog::changeMetadata(
    std::uint64_t epoch, const std::vector<std::int64_t>& shapeIds,
    const std::function<std::optional<Metadata>(const store::Shape&)>& change) {
    const RestoreGate::Write write(restores_);
    RETURN_IF_ERROR(requireEpoch(epoch));
    auto changed = store_->changeMetadata(shapeIds, change);
    RETURN_IF_ERROR(changed);
    refreshOrLog(*changed, "new metadata is not searched yet");
    return changed;
}

Result<std::uint64_t> Catalog::retryShapes(std::uint64_t epoch, const std::vector<std::int64_t>& shapeIds) {
    const RestoreGate::Write write(restores_);
    RETURN_IF_ERROR(requireEpoch(epoch));
    const auto queued = store_->retryShapes(shapeIds, options_.maxQueuedJobs, options_.maxQueuedBytes);
    if (queued.value_or(0) > 0) workers_.wake();
    return queued;
}

// Following ------------------------------------------------------------------------------

Result<store::Shape> Catalog::followIngest(
    std::int64_t shapeId, const Checkpoint& checkpoint,
    const std::function<Result<void>(const store::Shape&, const ingest::ProgressBoard::Status&)>& onChange) {
    const auto watch = board_.watch(shapeId);
    for (;;) {
        // Before the row: whatever happens after this raises the sequence, and the wait returns.
        const ingest::ProgressBoard::Status status = watch->status();
        auto shape = store_->getShapeById(shapeId);
        RETURN_IF_ERROR(shape);
        if (shape->state == store::ShapeState::kReady) {
            // The store is a moment ahead of the index: READY must mean that searches find it.
            RETURN_IF_ERROR(index_.refresh(shape->collectionId, shapeId));
        }
        RETURN_IF_ERROR(onChange(*shape, status));
        if (shape->state != store::ShapeState::kPending) return shape;
        if (auto trouble = workers_.trouble()) return fail(std::move(*trouble));
        const auto lookAgain = ingest::ProgressBoard::Clock::now() + kReadStateAgain;
        while (watch->status().sequence == status.sequence &&
               ingest::ProgressBoard::Clock::now() < lookAgain) {
            RETURN_IF_ERROR(checkpoint());
            watch->waitForChange(status.sequence, ingest::ProgressBoard::Clock::now() + kLookForCancellation);
        }
    }
}

bool operator==(const IngestEvent& a, const IngestEvent& b) {
    const auto sameFailure = [&] {
        if (!a.failure || !b.failure) return a.failure.has_value() == b.failure.has_value();
        return a.failure->code == b.failure->code && a.failure->message == b.failure->message;
    };
    return a.state == b.state && a.stage == b.stage && a.done == b.done && a.total == b.total &&
           a.quality == b.quality && sameFailure();
}

IngestEvent Catalog::eventOf(const store::Shape& shape, const ingest::ProgressBoard::Status& status) const {
    IngestEvent event;
    event.state = shape.state;
    event.failure = shape.failure;
    if (shape.state == store::ShapeState::kPending) {
        event.stage = status.stage;
        event.done = status.done;
        event.total = status.total;
    }
    if (shape.state == store::ShapeState::kReady) event.quality = servingQuality(shape);
    return event;
}

Result<void> Catalog::watchIngest(std::int64_t shapeId, const Checkpoint& checkpoint,
                                  const std::function<Result<void>(const IngestEvent&)>& onEvent) {
    std::optional<IngestEvent> last;
    const auto tell = [&](const store::Shape& shape,
                          const ingest::ProgressBoard::Status& status) -> Result<void> {
        IngestEvent event = eventOf(shape, status);
        if (last && event == *last) return {};
        last = std::move(event);
        return onEvent(*last);
    };
    const auto settled = followIngest(shapeId, checkpoint, tell);
    RETURN_IF_ERROR(settled);
    return {};
}

Result<store::Shape> Catalog::awaitIngest(const store::Shape& added, const Checkpoint& checkpoint) {
    auto settled =
        followIngest(added.id, checkpoint, [](const auto&, const auto&) { return Result<void>(); });
    // Gone: deleted meanwhile, with its scan.
    if (!settled && settled.error().code != ErrorCode::kNotFound) {
        return fail(settled.error().code,
                    settled.error().message + "; the scan is stored and will be segmented");
    }
    return settled;
}

Result<Catalog::StoredScan> Catalog::storedScan(const FoundShape& found, Budget::Share& share) {
    store::Shape shape = found.shape;
    RETURN_IF_ERROR(share.take(shape.pointCount * kPointBytes));
    for (;;) {
        auto points = store_->loadPoints(shape.id);
        RETURN_IF_ERROR(points);
        auto now = store_->getShapeById(shape.id);
        RETURN_IF_ERROR(now);
        const bool same = now->pointsVersion == shape.pointsVersion;
        if (!same && now->pointCount > shape.pointCount) {
            RETURN_IF_ERROR(share.take((now->pointCount - shape.pointCount) * kPointBytes));
        }
        shape = std::move(*now);
        if (same) return StoredScan{std::move(shape), std::move(points->xyz)};
        // Replaced while they were read: again, so that shape and points belong together.
    }
}

// Segmentation for callers ---------------------------------------------------------------

Result<Description> Catalog::describe(SegmentationSlots::Slot& slot, const store::VerifiedScan& scan,
                                      const ShapeParameters& parameters, const RunContext& context) {
    context.report("queued", 0, 0);
    RETURN_IF_ERROR(slot.acquire(context));
    return pipeline_.describe(scan.points(), scan.origin(), parameters, context);
}

Result<DescribedScan> Catalog::describe(SegmentationSlots::Slot& slot, const FoundShape& found,
                                        const RunContext& context) {
    RETURN_IF_ERROR(found.collection->requireParameters());
    RETURN_IF_ERROR(slot.acquire(context));
    auto points = store_->loadPoints(found.shape.id);
    RETURN_IF_ERROR(points);
    auto description = pipeline_.describe(points->xyz, points->origin, found.collection->parameters, context);
    RETURN_IF_ERROR(description);
    return DescribedScan{std::move(*points), std::move(*description)};
}

}  // namespace shapedb::catalog
