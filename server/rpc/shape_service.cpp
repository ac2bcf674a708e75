// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/shape_service.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/catalog/even_sample.h"
#include "server/catalog/listing.h"
#include "server/catalog/scan_upload.h"
#include "server/catalog/shape_addition.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/limit_table.h"
#include "server/rpc/receive_scan.h"

namespace shapedb::rpc {
namespace {

pb::AddShapeResponse::Outcome outcomeOf(store::PutOutcome outcome) {
    switch (outcome) {
        case store::PutOutcome::kCreated: return pb::AddShapeResponse::OUTCOME_CREATED;
        case store::PutOutcome::kReplaced: return pb::AddShapeResponse::OUTCOME_REPLACED;
        case store::PutOutcome::kMetadataChanged: return pb::AddShapeResponse::OUTCOME_METADATA_CHANGED;
        case store::PutOutcome::kUnchanged: return pb::AddShapeResponse::OUTCOME_UNCHANGED;
        case store::PutOutcome::kRetried: return pb::AddShapeResponse::OUTCOME_RETRIED;
    }
    return pb::AddShapeResponse::OUTCOME_UNSPECIFIED;
}

Result<catalog::ShapeHeader> headerFrom(const pb::AddShapeHeader& message) {
    catalog::ShapeHeader header;
    const auto mode = fromProto(message.mode());
    RETURN_IF_ERROR(mode);
    header.collection = message.collection();
    header.key = message.key();
    header.mode = *mode;
    if (message.has_expected_version()) header.expectedVersion = message.expected_version();
    if (!message.has_metadata_change()) {
        // An upload without metadata leaves those of the shape alone.
        if (!message.metadata().empty()) header.metadata = store::replacedBy(toMetadata(message.metadata()));
        return header;
    }
    if (!message.metadata().empty()) {
        return fail(ErrorCode::kInvalidArgument, "metadata_change: metadata is set too: leave one out");
    }
    header.metadata = fromProto(message.metadata_change());
    return header;
}

/// One summary, then the points of the sample in the order they were uploaded, each with its segment.
template <typename Writer>
Result<void> sendSegments(Call& call, Writer& writer, const Description& description,
                          const std::vector<float>& xyz, const Point3& origin,
                          const catalog::EvenSample& sample) {
    pb::SegmentedPoints message;
    toProto(description.segmentation, message.mutable_summary()->mutable_report());
    toProto(description.signature, message.mutable_summary()->mutable_signature());
    if (origin != Point3{}) toProto(origin, message.mutable_summary()->mutable_origin());
    RETURN_IF_ERROR(call.write(writer, message));
    const auto& labels = description.segmentation.pointSegment;
    for (std::size_t first = 0; first < sample.size(); first += kLabelledChunkPoints) {
        const std::size_t count = std::min(kLabelledChunkPoints, sample.size() - first);
        message.Clear();
        pb::LabelledChunk* chunk = message.mutable_chunk();
        chunk->mutable_xyz()->resize(count * catalog::kPointBytes);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t point = sample.at(first + i);
            std::memcpy(chunk->mutable_xyz()->data() + i * catalog::kPointBytes, xyz.data() + 3 * point,
                        catalog::kPointBytes);
            chunk->add_segments(labels[point]);
        }
        RETURN_IF_ERROR(call.write(writer, message));
    }
    return {};
}

/// Replaces the points by those of a sample.
void keepSample(std::vector<float>& xyz, const catalog::EvenSample& sample) {
    for (std::size_t i = 0; i < sample.size(); ++i) {
        // No sample names a point before its own place, so that none is overwritten too early.
        std::copy_n(xyz.begin() + static_cast<std::ptrdiff_t>(3 * sample.at(i)), 3,
                    xyz.begin() + static_cast<std::ptrdiff_t>(3 * i));
    }
    xyz.resize(3 * sample.size());
}

void toProto(const SurfacePoints& surface, std::size_t most, pb::Preview* preview) {
    const std::size_t count = most == 0 ? surface.size() : std::min(most, surface.size());
    std::vector<float> xyz;
    std::string normals;
    for (std::size_t i = 0; i < count; ++i) {
        const Point3 position = surface.position(i) - surface.centre;
        const Point3 normal = surface.normal(i);
        for (const double value : {position.x, position.y, position.z}) {
            xyz.push_back(static_cast<float>(value));
        }
        for (const double value : {normal.x, normal.y, normal.z}) {
            normals.push_back(static_cast<char>(std::lround(127 * value)));
        }
    }
    preview->set_xyz(xyz.data(), xyz.size() * sizeof(float));
    preview->set_normals(std::move(normals));
}

template <typename Writer>
Result<void> sendPoints(Call& call, Writer& writer, const std::vector<float>& xyz) {
    constexpr std::size_t kChunk = catalog::kMaxChunkBytes / catalog::kPointBytes * catalog::kPointBytes;
    const auto* bytes = reinterpret_cast<const char*>(xyz.data());
    const std::size_t size = xyz.size() * sizeof(float);
    for (std::size_t at = 0; at < size; at += kChunk) {
        v1::StoredPoints message;
        message.mutable_chunk()->set_xyz(bytes + at, std::min(kChunk, size - at));
        RETURN_IF_ERROR(call.write(writer, message));
    }
    return {};
}

}  // namespace

ShapeServiceHandler::ShapeServiceHandler(const Services& services) : services_(services) {
    serve("AddShape", this, &ShapeServiceHandler::addShape);
    serve("Segment", this, &ShapeServiceHandler::segment);
    serve("GetShape", this, &ShapeServiceHandler::getShape);
    serve("GetShapes", this, &ShapeServiceHandler::getShapes);
    serve("GetPoints", this, &ShapeServiceHandler::getPoints);
    serve("GetPreviews", this, &ShapeServiceHandler::getPreviews);
    serve("ListShapes", this, &ShapeServiceHandler::listShapes);
    serve("CountShapes", this, &ShapeServiceHandler::countShapes);
    serve("CountByValue", this, &ShapeServiceHandler::countByValue);
    serve("DeleteShape", this, &ShapeServiceHandler::deleteShape);
    serve("DeleteShapes", this, &ShapeServiceHandler::deleteShapes);
    serve("UpdateMetadata", this, &ShapeServiceHandler::updateMetadata);
    serve("RetryShapes", this, &ShapeServiceHandler::retryShapes);
    serve("WatchIngest", this, &ShapeServiceHandler::watchIngest);
    serve("GetSignature", this, &ShapeServiceHandler::getSignature);
    serve("GetSegments", this, &ShapeServiceHandler::getSegments);
}

grpc::Status ShapeServiceHandler::addShape(grpc::ServerContext* context,
                                           Upload<v1::AddShapeRequest>& messages,
                                           v1::AddShapeResponse* response) {
    return handle(services_, context, operations::kAddShape, messages,
                  [&](Call& call) { return add(call, messages, *response); });
}

Result<void> ShapeServiceHandler::add(Call& call, Upload<v1::AddShapeRequest>& messages,
                                      v1::AddShapeResponse& response) {
    catalog::ShapeAddition addition(services_.catalog, call.frame(), services_.config.limits.maxPoints,
                                    services_.admission.uploads);
    const auto takeHeader = [&](const v1::AddShapeHeader& message) -> Result<void> {
        call.noteKey(message.key());
        const auto collection = call.useCollection(message.collection());
        RETURN_IF_ERROR(collection);
        auto header = headerFrom(message);
        RETURN_IF_ERROR(header);
        header->collection = *collection;
        return addition.begin(std::move(*header), message.wait());
    };
    auto scan = receiveScan(services_, messages, addition.upload(), call, takeHeader);
    RETURN_IF_ERROR(scan);
    const auto added = addition.finish(std::move(*scan));
    RETURN_IF_ERROR(added);
    response.set_change(services_.catalog.changeOf(added->shape));
    response.set_outcome(outcomeOf(added->outcome));
    toProto(added->shape, added->collection, services_.catalog.servingQuality(added->shape),
            response.mutable_shape());
    return {};
}

grpc::Status ShapeServiceHandler::getShape(grpc::ServerContext* context,
                                           Request<v1::GetShapeRequest>& request,
                                           v1::GetShapeResponse* response) {
    return handle(services_, context, operations::kGetShape, request, [&](Call& call) -> Result<void> {
        const auto found = call.shape(request->shape());
        RETURN_IF_ERROR(found);
        response->set_change(services_.catalog.changeOf(found->shape));
        const auto quality = services_.catalog.quality(*found->collection, found->shape.id);
        toProto(found->shape, found->collection->collection.name, quality, response->mutable_shape());
        return {};
    });
}

grpc::Status ShapeServiceHandler::getShapes(grpc::ServerContext* context,
                                            Request<v1::GetShapesRequest>& request,
                                            v1::GetShapesResponse* response) {
    return handle(services_, context, operations::kGetShapes, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        call.note({"keys", std::int64_t{request->keys_size()}});
        const auto visit = [&](const store::Shape& shape, std::optional<double> quality) {
            pb::Shape* out = response->add_shapes();
            toProto(shape, (*collection)->collection.name, quality, out);
            return out->ByteSizeLong();
        };
        const auto missing = catalog::visitShapes(services_.catalog, **collection,
                                                  {request->keys().begin(), request->keys().end()},
                                                  request.answerRoom(services_.admission.answers), visit);
        RETURN_IF_ERROR(missing);
        for (const std::string& key : *missing) response->add_missing(key);
        return {};
    });
}

grpc::Status ShapeServiceHandler::getPoints(grpc::ServerContext* context,
                                            Request<v1::GetPointsRequest>& request,
                                            Replies<v1::StoredPoints>* writer) {
    return handle(services_, context, operations::kGetPoints, request, [&](Call& call) -> Result<void> {
        const auto found = call.shape(request->shape());
        RETURN_IF_ERROR(found);
        catalog::Budget::Share share(services_.admission.uploads);
        auto scan = services_.catalog.storedScan(*found, share);
        RETURN_IF_ERROR(scan);
        keepSample(scan->points, {scan->points.size() / 3, request->max_points()});
        call.addPoints(scan->points.size() / 3, scan->points.size() * sizeof(float));
        v1::StoredPoints message;
        toProto(scan->shape, found->collection->collection.name,
                services_.catalog.servingQuality(scan->shape), message.mutable_shape());
        RETURN_IF_ERROR(call.write(*writer, message));
        return sendPoints(call, *writer, scan->points);
    });
}

grpc::Status ShapeServiceHandler::getPreviews(grpc::ServerContext* context,
                                              Request<v1::GetPreviewsRequest>& request,
                                              v1::GetPreviewsResponse* response) {
    return handle(services_, context, operations::kGetPreviews, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        call.note({"keys", std::int64_t{request->keys_size()}});
        Result<void> read;
        const auto visit = [&](const store::Shape& shape, std::optional<double> /*quality*/) -> std::size_t {
            if (!read) return 0;
            pb::Preview* preview = response->add_previews();
            preview->set_key(shape.key);
            preview->set_version(shape.version);
            const auto surface = services_.catalog.surface(shape.id);
            if (!surface) {
                read = fail(surface.error());
            } else if (*surface) {
                toProto(**surface, request->max_points(), preview);
            }
            return preview->ByteSizeLong();
        };
        RETURN_IF_ERROR(catalog::visitShapes(services_.catalog, **collection,
                                             {request->keys().begin(), request->keys().end()},
                                             request.answerRoom(services_.admission.answers), visit));
        return read;
    });
}

grpc::Status ShapeServiceHandler::listShapes(grpc::ServerContext* context,
                                             Request<v1::ListShapesRequest>& request,
                                             v1::ListShapesResponse* response) {
    return handle(services_, context, operations::kListShapes, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        const auto state = fromProto(request->state());
        RETURN_IF_ERROR(state);
        const auto order = fromProto(request->order());
        RETURN_IF_ERROR(order);
        const catalog::ListRequest wanted{{request->filter(), *state, request->key_prefix()},
                                          request->page_size(),
                                          request->cursor(),
                                          *order,
                                          request->descending()};
        const auto next = catalog::listPage(services_.catalog, **collection, wanted, call.run(),
                                            [&](const store::Shape& shape, std::optional<double> quality) {
                                                pb::Shape* out = response->add_shapes();
                                                toProto(shape, (*collection)->collection.name, quality, out);
                                                return out->ByteSizeLong();
                                            });
        RETURN_IF_ERROR(next);
        response->set_next_cursor(*next);
        return {};
    });
}

grpc::Status ShapeServiceHandler::countShapes(grpc::ServerContext* context,
                                              Request<v1::CountShapesRequest>& request,
                                              v1::CountShapesResponse* response) {
    return handle(services_, context, operations::kCountShapes, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        const auto state = fromProto(request->state());
        RETURN_IF_ERROR(state);
        const auto count = catalog::countSelected(
            services_.catalog, **collection, {request->filter(), *state, request->key_prefix()}, call.run());
        RETURN_IF_ERROR(count);
        response->set_count(*count);
        return {};
    });
}

grpc::Status ShapeServiceHandler::countByValue(grpc::ServerContext* context,
                                               Request<v1::CountByValueRequest>& request,
                                               v1::CountByValueResponse* response) {
    return handle(services_, context, operations::kCountByValue, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        const auto state = fromProto(request->state());
        RETURN_IF_ERROR(state);
        const auto counts =
            catalog::countByValue(services_.catalog, **collection, {request->filter(), *state, {}},
                                  request->metadata_key(), request->max_values(), call.run());
        RETURN_IF_ERROR(counts);
        for (const catalog::ValueCount& one : counts->values) {
            auto* out = response->add_values();
            out->set_value(one.value);
            out->set_shapes(one.shapes);
        }
        response->set_other_values(counts->otherValues);
        response->set_other_shapes(counts->otherShapes);
        response->set_shapes_without(counts->without);
        return {};
    });
}

grpc::Status ShapeServiceHandler::deleteShape(grpc::ServerContext* context,
                                              Request<v1::DeleteShapeRequest>& request,
                                              v1::DeleteShapeResponse* response) {
    return handle(services_, context, operations::kDeleteShape, request, [&](Call& call) -> Result<void> {
        const pb::ShapeRef& ref = request->shape();
        call.noteKey(ref.key());
        const auto collection = call.useCollection(ref.collection());
        RETURN_IF_ERROR(collection);
        std::optional<std::int64_t> expected;
        if (request->has_expected_version()) expected = request->expected_version();
        const auto deleted = services_.catalog.deleteShape(*collection, ref.key(), expected);
        RETURN_IF_ERROR(deleted);
        response->set_change(services_.catalog.changeOf(deleted->shape));
        toProto(deleted->shape, deleted->collection->collection.name, deleted->quality,
                response->mutable_shape());
        return {};
    });
}

grpc::Status ShapeServiceHandler::deleteShapes(grpc::ServerContext* context,
                                               Request<v1::DeleteShapesRequest>& request,
                                               v1::DeleteShapesResponse* response) {
    return handle(services_, context, operations::kDeleteShapes, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        const auto result = catalog::deleteShapes(services_.catalog, **collection,
                                                  fromProto(request->selection()), call.run());
        RETURN_IF_ERROR(result);
        call.note({"deleted", result->deleted});
        response->set_deleted(result->deleted);
        for (const std::string& key : result->missing) response->add_missing(key);
        return {};
    });
}

grpc::Status ShapeServiceHandler::updateMetadata(grpc::ServerContext* context,
                                                 Request<v1::UpdateMetadataRequest>& request,
                                                 v1::UpdateMetadataResponse* response) {
    return handle(services_, context, operations::kUpdateMetadata, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        return changeMetadata(call, *collection, *request, *response);
    });
}

Result<void> ShapeServiceHandler::changeMetadata(Call& call, const index::SnapshotPtr& collection,
                                                 const v1::UpdateMetadataRequest& request,
                                                 v1::UpdateMetadataResponse& response) {
    const store::MetadataChange change = fromProto(request.change());
    if (!request.has_filter()) {
        call.noteKey(request.key());
        std::optional<std::int64_t> expected;
        if (request.has_expected_version()) expected = request.expected_version();
        const auto result =
            catalog::changeMetadataOf(services_.catalog, collection, request.key(), change, expected);
        RETURN_IF_ERROR(result);
        (result->changed ? response.set_changed(1) : response.set_unchanged(1));
        toProto(result->shape, collection->collection.name, services_.catalog.servingQuality(result->shape),
                response.mutable_shape());
        return {};
    }
    if (request.has_expected_version()) {
        return fail(ErrorCode::kInvalidArgument, "expected_version: not with a filter");
    }
    const auto result =
        catalog::changeMetadata(services_.catalog, *collection, request.filter(), change, call.run());
    RETURN_IF_ERROR(result);
    call.note({"changed", result->changed});
    response.set_changed(result->changed);
    response.set_unchanged(result->unchanged);
    response.set_refused(result->refused);
    if (result->firstRefused) {
        response.set_first_refused_key(result->firstRefusedKey);
        toProto(*result->firstRefused, response.mutable_first_refused());
    }
    return {};
}

grpc::Status ShapeServiceHandler::retryShapes(grpc::ServerContext* context,
                                              Request<v1::RetryShapesRequest>& request,
                                              v1::RetryShapesResponse* response) {
    return handle(services_, context, operations::kRetryShapes, request, [&](Call& call) -> Result<void> {
        const auto collection = call.collection(request->collection());
        RETURN_IF_ERROR(collection);
        const auto result = catalog::retryShapes(services_.catalog, **collection,
                                                 fromProto(request->selection()), call.run());
        if (!result && result.error().code == ErrorCode::kQueueFull) {
            call.frame().retryAfter(services_.catalog.retryAfterQueueFull());
        }
        RETURN_IF_ERROR(result);
        call.note({"queued", result->queued});
        response->set_queued(result->queued);
        response->set_left(result->left);
        for (const std::string& key : result->notFailed) response->add_not_failed(key);
        for (const std::string& key : result->missing) response->add_missing(key);
        return {};
    });
}

grpc::Status ShapeServiceHandler::watchIngest(grpc::ServerContext* context,
                                              Request<v1::WatchIngestRequest>& request,
                                              Replies<v1::IngestEvent>* writer) {
    return handle(services_, context, operations::kWatchIngest, request, [&](Call& call) -> Result<void> {
        const auto found = call.shape(request->shape());
        RETURN_IF_ERROR(found);
        RETURN_IF_ERROR(call.frame().becomeFollower());
        const auto tell = [&](const catalog::IngestEvent& event) -> Result<void> {
            v1::IngestEvent out;
            out.set_state(toProto(event.state));
            out.set_stage(event.stage);
            out.set_done(event.done);
            out.set_total(event.total);
            if (event.failure) toProto(*event.failure, out.mutable_failure());
            if (event.quality) out.set_quality(*event.quality);
            return call.write(*writer, out);
        };
        return services_.catalog.watchIngest(
            found->shape.id, [&] { return call.frame().checkpointWhileFollowing(); }, tell);
    });
}

grpc::Status ShapeServiceHandler::getSignature(grpc::ServerContext* context,
                                               Request<v1::GetSignatureRequest>& request,
                                               v1::GetSignatureResponse* response) {
    return handle(services_, context, operations::kGetSignature, request, [&](Call& call) -> Result<void> {
        auto found = call.shape(request->shape());
        RETURN_IF_ERROR(found);
        const auto signature = services_.catalog.signature(*found);
        RETURN_IF_ERROR(signature);
        toProto(*signature, response->mutable_signature());
        return {};
    });
}

grpc::Status ShapeServiceHandler::getSegments(grpc::ServerContext* context,
                                              Request<v1::GetSegmentsRequest>& request,
                                              Replies<v1::SegmentedPoints>* writer) {
    return handle(services_, context, operations::kGetSegments, request, [&](Call& call) -> Result<void> {
        const auto found = call.shape(request->shape());
        RETURN_IF_ERROR(found);
        catalog::SegmentationSlots::Slot slot(services_.catalog.segmentationSlots());
        const auto scan = services_.catalog.describe(slot, *found, call.run());
        RETURN_IF_ERROR(scan);
        const store::StoredPoints& points = scan->points;
        const catalog::EvenSample sample(points.xyz.size() / 3, request->max_points());
        call.addPoints(sample.size(), sample.size() * catalog::kPointBytes);
        return sendSegments(call, *writer, scan->description, points.xyz, points.origin, sample);
    });
}

grpc::Status ShapeServiceHandler::segment(grpc::ServerContext* context, Upload<v1::SegmentRequest>& messages,
                                          UploadReplies<v1::SegmentedPoints>* writer) {
    return handle(services_, context, operations::kSegment, messages, [&](Call& call) -> Result<void> {
        catalog::ScanUpload upload(services_.config.limits.maxPoints, services_.admission.uploads);
        ShapeParameters parameters;
        bool summaryOnly = false;
        bool reportStages = false;
        const auto checkSegmentHeader = [&](const v1::SegmentHeader& header) -> Result<void> {
            const auto wanted = overridesFrom(header.profile(), header.segmentation(), header.signature());
            RETURN_IF_ERROR(wanted);
            const auto checked = wanted->ofNew();
            RETURN_IF_ERROR(checked);
            parameters = *checked;
            summaryOnly = header.summary_only();
            reportStages = header.report_stages();
            return {};
        };
        const auto scan = receiveScan(services_, messages, upload, call, checkSegmentHeader);
        RETURN_IF_ERROR(scan);
        const RunContext running = tellingStages<v1::SegmentedPoints>(call, *writer, reportStages);
        catalog::SegmentationSlots::Slot slot(services_.catalog.segmentationSlots());
        const auto description = services_.catalog.describe(slot, *scan, parameters, running);
        RETURN_IF_ERROR(description);
        // Without points: a sample of none.
        const catalog::EvenSample sample(summaryOnly ? 0 : scan->points().size() / 3, 0);
        return sendSegments(call, *writer, *description, scan->points(), scan->origin(), sample);
    });
}

}  // namespace shapedb::rpc
