#include "server/rpc/shape_service.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/search/filter.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/cursor.h"
#include "server/rpc/limits.h"
#include "server/rpc/point_stream.h"
#include "server/rpc/request_checks.h"
#include "server/rpc/scan_check.h"
#include "server/rpc/shape_lookup.h"

namespace shapedb::rpc {
namespace {

pb::AddShapeResponse::Outcome outcomeOf(store::PutOutcome outcome) {
    switch (outcome) {
        case store::PutOutcome::kCreated: return pb::AddShapeResponse::OUTCOME_CREATED;
        case store::PutOutcome::kReplaced: return pb::AddShapeResponse::OUTCOME_REPLACED;
        case store::PutOutcome::kMetadataChanged: return pb::AddShapeResponse::OUTCOME_METADATA_CHANGED;
        case store::PutOutcome::kUnchanged: return pb::AddShapeResponse::OUTCOME_UNCHANGED;
    }
    return pb::AddShapeResponse::OUTCOME_UNSPECIFIED;
}

Result<void> checkHeader(const Services& services, Call& call, const pb::AddShapeHeader& header) {
    call.noteKey(header.key());
    RETURN_IF_ERROR(checkKey(header.key()));
    RETURN_IF_ERROR(fromProto(header.mode()));
    RETURN_IF_ERROR(checkMetadata(toMetadata(header.metadata())));
    if (header.has_expected_version() && header.expected_version() < 0) {
        return fail(ErrorCode::kInvalidArgument, "expected_version: must be 0 (the key is free) or more");
    }
    RETURN_IF_ERROR(call.collection(header.collection()));
    if (header.wait()) {
        RETURN_IF_ERROR(call.becomeFollower());
    }
    if (services.restores.restoring()) {
        return fail(ErrorCode::kUnavailable, "the database is being replaced by a backup: try again later");
    }
    return {};
}

/// The parts of a request ListShapes and CountShapes share.
Result<store::ShapeFilter> makeFilter(const Call& call, const std::string& text, pb::ShapeState state) {
    RETURN_IF_ERROR(checkFilterLength(text));
    Result<Filter> filter = Filter::parse(text);
    RETURN_IF_ERROR(filter);
    const auto wanted = fromProto(state);
    RETURN_IF_ERROR(wanted);
    store::ShapeFilter result;
    result.state = *wanted;
    const RunContext* run = &call.run();
    const bool all = filter->acceptsAll();
    // Also how a listing of millions is left when the caller is gone: nothing passes any more.
    result.accept = [filter = std::move(*filter), run, all](const store::Shape& shape) {
        return run->checkpoint().has_value() && (all || filter.matches(shape.metadata));
    };
    return result;
}

/// One summary, then the points in the order they were uploaded, each with its segment.
template <typename Writer>
Result<void> sendSegments(Call& call, Writer& writer, const Description& description,
                          const std::vector<float>& xyz, bool summaryOnly) {
    pb::SegmentedPoints message;
    toProto(description.segmentation, message.mutable_summary()->mutable_report());
    toProto(description.signature, message.mutable_summary()->mutable_signature());
    if (const auto sent = call.write(writer, message); !sent || summaryOnly) return sent;

    const auto& labels = description.segmentation.pointSegment;
    for (std::size_t first = 0; first < labels.size(); first += kLabelledChunkPoints) {
        const std::size_t count = std::min(kLabelledChunkPoints, labels.size() - first);
        message.Clear();
        pb::LabelledChunk* chunk = message.mutable_chunk();
        chunk->mutable_xyz()->resize(count * kPointBytes);
        std::memcpy(chunk->mutable_xyz()->data(), xyz.data() + 3 * first, count * kPointBytes);
        chunk->mutable_segments()->Add(labels.begin() + static_cast<std::ptrdiff_t>(first),
                                       labels.begin() + static_cast<std::ptrdiff_t>(first + count));
        RETURN_IF_ERROR(call.write(writer, message));
    }
    return {};
}

}  // namespace

grpc::Status ShapeServiceHandler::AddShape(grpc::ServerContext* context,
                                           grpc::ServerReader<v1::AddShapeRequest>* reader,
                                           v1::AddShapeResponse* response) {
    return handle(services_, context, "AddShape",
                  [&](Call& call) { return addShape(call, *reader, *response); });
}

Result<void> ShapeServiceHandler::addShape(Call& call, grpc::ServerReader<v1::AddShapeRequest>& reader,
                                           v1::AddShapeResponse& response) {
    store::PutResult put;
    std::string collectionName;
    bool wait = false;
    {
        // The points are given back before any waiting.
        PointReceiver receiver(services_.config.limits.maxPoints, services_.uploads);
        v1::AddShapeHeader header;
        const auto scan = receiveScan<v1::AddShapeRequest>(reader, receiver, call, [&](const auto& received) {
            header = received;
            return checkHeader(services_, call, received);
        });
        if (!scan && scan.error().code == ErrorCode::kQueueFull) call.retryAfter(kBudgetRetry);
        RETURN_IF_ERROR(scan);
        RETURN_IF_ERROR(checkUsable(scan->xyz));
        RETURN_IF_ERROR(call.run().checkpoint());

        const RestoreGate::Write write(services_.restores);
        // Again: it may have been deleted, or replaced by a restore, while the points came.
        const auto collection = call.collection(header.collection());
        RETURN_IF_ERROR(collection);
        store::PutRequest request;
        request.collectionId = (*collection)->collection.id;
        request.key = header.key();
        request.mode = *fromProto(header.mode());
        if (header.has_expected_version()) request.expectedVersion = header.expected_version();
        request.metadata = toMetadata(header.metadata());
        request.points = &scan->xyz;
        request.checksum = scan->checksum;
        request.maxQueuedJobs = services_.config.ingest.maxQueuedJobs;
        request.maxQueuedBytes = services_.config.ingest.maxQueuedBytes;
        const auto stored = services_.store.putShape(request);
        if (!stored && stored.error().code == ErrorCode::kQueueFull) {
            const auto depth = services_.store.queueDepth();
            call.retryAfter(services_.workers.retryAfter(depth ? depth->jobs : 0));
        }
        RETURN_IF_ERROR(stored);
        put = *stored;
        collectionName = (*collection)->collection.name;
        wait = header.wait();
    }
    const bool queued =
        put.outcome == store::PutOutcome::kCreated || put.outcome == store::PutOutcome::kReplaced;
    if (put.outcome == store::PutOutcome::kReplaced)
        services_.workers.supersede(put.shape.id, put.shape.pointsVersion);
    if (queued) services_.workers.wake();
    if (put.outcome == store::PutOutcome::kReplaced || put.outcome == store::PutOutcome::kMetadataChanged) {
        const auto refreshed = services_.index.refresh(put.shape.collectionId, put.shape.id);
        // Stored all the same: the caller must not take this for a refusal.
        if (!refreshed)
            services_.log->error("new metadata is not searched yet", telemetry::fieldsOf(refreshed.error()));
    }
    if (wait) {
        const auto settled = followIngest(
            services_, put.shape.id, [&] { return call.run().checkpoint(); },
            [](const auto&, const auto&) { return Result<void>(); });
        if (!settled) {
            return fail(settled.error().code, settled.error().message + "; the scan of shape '" +
                                                  put.shape.key + "' had been stored");
        }
        put.shape = *settled;
    }
    response.set_outcome(outcomeOf(put.outcome));
    toProto(put.shape, collectionName, servingQuality(services_, put.shape), response.mutable_shape());
    return {};
}

grpc::Status ShapeServiceHandler::GetShape(grpc::ServerContext* context, const v1::GetShapeRequest* request,
                                           v1::GetShapeResponse* response) {
    return handle(services_, context, "GetShape", [&](Call& call) -> Result<void> {
        const auto found = findShape(services_, call, request->shape());
        RETURN_IF_ERROR(found);
        toProto(found->shape, found->collection->collection.name,
                qualityIn(found->collection->signatures, found->shape.id), response->mutable_shape());
        return {};
    });
}

grpc::Status ShapeServiceHandler::ListShapes(grpc::ServerContext* context,
                                             const v1::ListShapesRequest* request,
                                             v1::ListShapesResponse* response) {
    return handle(services_, context, "ListShapes", [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        RETURN_IF_ERROR(checkPageSize(request->page_size()));
        const auto filter = makeFilter(call, request->filter(), request->state());
        RETURN_IF_ERROR(filter);
        const Listing listing{(*collection)->collection.id, request->filter(), request->state()};
        const auto afterId = decodeCursor(listing, request->cursor());
        RETURN_IF_ERROR(afterId);

        const std::size_t pageSize = request->page_size() == 0 ? kDefaultPageSize : request->page_size();
        // One more than asked for tells whether there is a next page.
        const auto shapes = services_.store.listShapes(listing.collectionId, *afterId, pageSize + 1, *filter);
        RETURN_IF_ERROR(shapes);
        RETURN_IF_ERROR(call.run().checkpoint());
        std::size_t bytes = 0;
        std::size_t sent = 0;
        for (; sent < std::min(pageSize, shapes->size()) && bytes < kMaxPageBytes; ++sent) {
            pb::Shape* shape = response->add_shapes();
            toProto((*shapes)[sent], (*collection)->collection.name,
                    qualityIn((*collection)->signatures, (*shapes)[sent].id), shape);
            bytes += shape->ByteSizeLong();
        }
        if (sent < shapes->size()) response->set_next_cursor(encodeCursor(listing, (*shapes)[sent - 1].id));
        return {};
    });
}

grpc::Status ShapeServiceHandler::CountShapes(grpc::ServerContext* context,
                                              const v1::CountShapesRequest* request,
                                              v1::CountShapesResponse* response) {
    return handle(services_, context, "CountShapes", [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        auto filter = makeFilter(call, request->filter(), request->state());
        RETURN_IF_ERROR(filter);
        if (request->filter().empty()) filter->accept = nullptr;  // the store counts without reading
        const auto count = services_.store.countShapes((*collection)->collection.id, *filter);
        RETURN_IF_ERROR(count);
        RETURN_IF_ERROR(call.run().checkpoint());
        response->set_count(*count);
        return {};
    });
}

grpc::Status ShapeServiceHandler::DeleteShape(grpc::ServerContext* context,
                                              const v1::DeleteShapeRequest* request,
                                              v1::DeleteShapeResponse* response) {
    return handle(services_, context, "DeleteShape", [&](Call& call) -> Result<void> {
        const RestoreGate::Write write(services_.restores);
        const pb::ShapeRef& ref = request->shape();
        call.noteKey(ref.key());
        const auto collection = call.collection(ref.collection());
        RETURN_IF_ERROR(collection);
        RETURN_IF_ERROR(checkKey(ref.key()));
        std::optional<std::int64_t> expected;
        if (request->has_expected_version()) expected = request->expected_version();
        const auto shape = services_.store.deleteShape((*collection)->collection.id, ref.key(), expected);
        RETURN_IF_ERROR(shape);
        services_.workers.supersede(shape->id);
        services_.board.settled(shape->id);
        if (const auto refreshed = services_.index.refresh(shape->collectionId, shape->id); !refreshed) {
            services_.log->error("deleted shape is still searched", telemetry::fieldsOf(refreshed.error()));
        }
        toProto(*shape, (*collection)->collection.name, qualityIn((*collection)->signatures, shape->id),
                response->mutable_shape());
        return {};
    });
}

grpc::Status ShapeServiceHandler::WatchIngest(grpc::ServerContext* context,
                                              const v1::WatchIngestRequest* request,
                                              grpc::ServerWriter<v1::IngestEvent>* writer) {
    return handle(services_, context, "WatchIngest", [&](Call& call) -> Result<void> {
        const auto found = findShape(services_, call, request->shape());
        RETURN_IF_ERROR(found);
        RETURN_IF_ERROR(call.becomeFollower());
        std::string last;
        const auto tell = [&](const store::Shape& shape,
                              const ingest::ProgressBoard::Status& status) -> Result<void> {
            v1::IngestEvent event;
            event.set_state(toProto(shape.state));
            if (shape.state == store::ShapeState::kPending) {
                event.set_stage(status.stage);
                event.set_done(status.done);
                event.set_total(status.total);
            }
            if (shape.failure) toProto(*shape.failure, event.mutable_failure());
            if (shape.state == store::ShapeState::kReady) {
                if (const auto quality = servingQuality(services_, shape)) event.set_quality(*quality);
            }
            const std::string text = event.SerializeAsString();
            if (text == last) return {};
            last = text;
            return call.write(*writer, event);
        };
        const auto settled = followIngest(
            services_, found->shape.id, [&] { return call.checkpointWhileFollowing(); }, tell);
        RETURN_IF_ERROR(settled);
        return {};
    });
}

grpc::Status ShapeServiceHandler::GetSignature(grpc::ServerContext* context,
                                               const v1::GetSignatureRequest* request,
                                               v1::GetSignatureResponse* response) {
    return handle(services_, context, "GetSignature", [&](Call& call) -> Result<void> {
        const auto found = findShape(services_, call, request->shape());
        RETURN_IF_ERROR(found);
        const auto signature = findSignature(services_, *found);
        RETURN_IF_ERROR(signature);
        toProto(*signature, response->mutable_signature());
        return {};
    });
}

grpc::Status ShapeServiceHandler::GetSegments(grpc::ServerContext* context,
                                              const v1::GetSegmentsRequest* request,
                                              grpc::ServerWriter<v1::SegmentedPoints>* writer) {
    return handle(services_, context, "GetSegments", [&](Call& call) -> Result<void> {
        const auto found = findShape(services_, call, request->shape());
        RETURN_IF_ERROR(found);
        SegmentationSlots::Slot slot(services_.slots);
        RETURN_IF_ERROR(slot.acquire(call.run()));
        const auto points = services_.store.loadPoints(found->shape.id);
        RETURN_IF_ERROR(points);
        call.addPoints(points->size() / 3, points->size() * sizeof(float));
        const auto description =
            services_.describe(ingest::toCloud(*points), found->collection->parameters, call.run());
        RETURN_IF_ERROR(description);
        return sendSegments(call, *writer, *description, *points, false);
    });
}

grpc::Status ShapeServiceHandler::Segment(
    grpc::ServerContext* context, grpc::ServerReaderWriter<v1::SegmentedPoints, v1::SegmentRequest>* stream) {
    return handle(services_, context, "Segment", [&](Call& call) -> Result<void> {
        PointReceiver receiver(services_.config.limits.maxPoints, services_.uploads);
        ShapeParameters parameters;
        bool summaryOnly = false;
        const auto checkSegmentHeader = [&](const v1::SegmentHeader& header) -> Result<void> {
            const auto wanted = parametersFrom(header.profile(), header.segmentation(), header.signature(),
                                               parametersOf(Profile::kDefault));
            RETURN_IF_ERROR(wanted);
            parameters = *wanted;
            summaryOnly = header.summary_only();
            return {};
        };
        const auto scan = receiveScan<v1::SegmentRequest>(*stream, receiver, call, checkSegmentHeader);
        if (!scan && scan.error().code == ErrorCode::kQueueFull) call.retryAfter(kBudgetRetry);
        RETURN_IF_ERROR(scan);
        SegmentationSlots::Slot slot(services_.slots);
        RETURN_IF_ERROR(slot.acquire(call.run()));
        const auto description = services_.describe(ingest::toCloud(scan->xyz), parameters, call.run());
        RETURN_IF_ERROR(description);
        return sendSegments(call, *stream, *description, scan->xyz, summaryOnly);
    });
}

}  // namespace shapedb::rpc
