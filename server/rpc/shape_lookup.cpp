#include "server/rpc/shape_lookup.h"

#include "core/base/return_if_error.h"
#include "core/signature/signature_codec.h"
#include "server/rpc/limits.h"
#include "server/rpc/request_checks.h"

namespace shapedb::rpc {

Result<FoundShape> findShape(const Services& services, Call& call, const pb::ShapeRef& ref) {
    call.noteKey(ref.key());
    const auto collection = call.collection(ref.collection());
    RETURN_IF_ERROR(collection);
    RETURN_IF_ERROR(checkKey(ref.key()));
    const auto shape = services.store.getShape((*collection)->collection.id, ref.key());
    if (!shape && shape.error().code == ErrorCode::kNotFound) {
        return fail(ErrorCode::kNotFound, "there is no shape '" + ref.key() + "' in collection '" +
                                              (*collection)->collection.name + "'");
    }
    RETURN_IF_ERROR(shape);
    return FoundShape{*collection, *shape};
}

Result<Signature> findSignature(const Services& services, const FoundShape& found) {
    if (found.collection->signatures.find(found.shape.id)) {
        return storedSignature(services, *found.collection, found.shape.id);
    }
    const std::string name = "shape '" + found.shape.key + "' has no signature";
    if (found.shape.failure) {
        return fail(ErrorCode::kNotReady, name + ": it cannot be segmented: " + found.shape.failure->message);
    }
    return fail(ErrorCode::kNotReady, name + " yet: wait until it is READY (WatchIngest)");
}

Result<Signature> storedSignature(const Services& services, const index::Snapshot& searched,
                                  std::int64_t shapeId) {
    const auto row = services.store.getSignature(shapeId);
    RETURN_IF_ERROR(row);
    if (row->generation != searched.collection.generation) {
        return fail(ErrorCode::kNotReady, "a rebuild of collection '" + searched.collection.name +
                                              "' is being put in place: try again");
    }
    auto signature = decodeSignature(row->bytes);
    if (!signature) {
        return fail(ErrorCode::kDataLoss, "the signature of shape " + std::to_string(shapeId) +
                                              " is damaged: " + signature.error().message);
    }
    return signature;
}

std::optional<double> qualityIn(const SignatureSet& signatures, std::int64_t shapeId) {
    const SignatureSet::Place place = signatures.find(shapeId);
    if (!place || !place.block->attributed(place.row)) return std::nullopt;
    return place.block->quality(place.row) / 255.0;
}

std::optional<double> servingQuality(const Services& services, const store::Shape& shape) {
    const auto collection = services.index.byId(shape.collectionId);
    return collection ? qualityIn((*collection)->signatures, shape.id) : std::nullopt;
}

Result<store::Shape> followIngest(
    const Services& services, std::int64_t shapeId, const std::function<Result<void>()>& checkpoint,
    const std::function<Result<void>(const store::Shape&, const ingest::ProgressBoard::Status&)>& onChange) {
    const auto watch = services.board.watch(shapeId);
    for (;;) {
        // The status first: what happens after it raises the sequence, and the wait returns.
        const ingest::ProgressBoard::Status status = watch->status();
        auto shape = services.store.getShapeById(shapeId);
        if (!shape) return shape;
        if (shape->state == store::ShapeState::kReady) {
            // Stored a moment before it is searched: who hears READY must find it.
            RETURN_IF_ERROR(services.index.refresh(shape->collectionId, shapeId));
        }
        RETURN_IF_ERROR(onChange(*shape, status));
        if (shape->state != store::ShapeState::kPending) return shape;
        const auto lookAgain = ingest::ProgressBoard::Clock::now() + kReadStateAgain;
        while (watch->status().sequence == status.sequence &&
               ingest::ProgressBoard::Clock::now() < lookAgain) {
            RETURN_IF_ERROR(checkpoint());
            watch->waitForChange(status.sequence, ingest::ProgressBoard::Clock::now() + kLookForCancellation);
        }
    }
}

}  // namespace shapedb::rpc
