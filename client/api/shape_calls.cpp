// SPDX-License-Identifier: Apache-2.0
// ShapeService.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "client/api/packing.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

v1::AddShapeRequest addHeader(const AddRequest& request, const PackedPoints& packed) {
    v1::AddShapeRequest message;
    v1::AddShapeHeader* header = message.mutable_header();
    header->set_collection(request.shape.collection);
    header->set_key(request.shape.key);
    header->set_mode(toWire(request.mode));
    if (request.metadata && !request.metadata->empty()) {
        header->mutable_metadata()->insert(request.metadata->begin(), request.metadata->end());
    } else if (request.metadata) {
        header->mutable_metadata_change()->set_replace_all(true);
    }
    if (request.expectedVersion) header->set_expected_version(*request.expectedVersion);
    fill(packed, header);
    header->set_wait(request.wait);
    return message;
}

/// Reads the reply of GetSegments or Segment.
template <typename Stream>
Result<void> readSegments(Stream& stream, SegmentedScan& scan, const RunContext& context) {
    Point3 origin;
    v1::SegmentedPoints message;
    while (stream.Read(&message)) {
        if (message.has_summary()) {
            scan.report = fromWire(message.summary().report());
            scan.signature = fromWire(message.summary().signature());
            origin = wire::fromProto(message.summary().origin());
        } else if (message.has_chunk()) {
            const v1::LabelledChunk& chunk = message.chunk();
            RETURN_IF_ERROR(unpackPoints(chunk.xyz(), origin, scan.points));
            scan.segments.insert(scan.segments.end(), chunk.segments().begin(), chunk.segments().end());
            context.report("download", scan.points.size(), scan.report.points);
        }
    }
    if (scan.points.size() != scan.segments.size()) {
        return fail(ErrorCode::kMalformedStream, "the server sent " + std::to_string(scan.points.size()) +
                                                     " points with " + std::to_string(scan.segments.size()) +
                                                     " segment labels");
    }
    return {};
}

}  // namespace

Result<AddReply> Client::addShape(const AddRequest& request, const PointCloud& points,
                                  const RunContext& context) const {
    const auto packed = packPoints(points);
    RETURN_IF_ERROR(packed);
    return impl_->add(request, *packed, context);
}

Result<AddReply> Client::Impl::add(const AddRequest& request, const PackedPoints& packed,
                                   const RunContext& context) {
    const v1::AddShapeRequest header = addHeader(request, packed);
    const CallTraits traits{!request.expectedVersion.has_value(), !request.wait};
    v1::AddShapeResponse response;
    const auto made =
        makeCall(options, context, traits, &header, [&](grpc::ClientContext& rpc, Result<void>&) {
            response.Clear();
            const auto stream = shapes->AddShape(&rpc, &response);
            writeScan(*stream, header, packed, context);
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    return AddReply{fromWire(response.outcome()), shapeOf(response)};
}

Result<Shape> Client::getShape(const ShapeRef& shape, const RunContext& context) const {
    v1::GetShapeRequest request;
    fill(shape, request.mutable_shape());
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::GetShape, request);
    RETURN_IF_ERROR(response);
    return shapeOf(*response);
}

Result<FoundShapes> Client::getShapes(const std::string& collection, const std::vector<std::string>& keys,
                                      const RunContext& context) const {
    v1::GetShapesRequest request;
    request.set_collection(collection);
    request.mutable_keys()->Add(keys.begin(), keys.end());
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::GetShapes, request);
    RETURN_IF_ERROR(response);
    FoundShapes found;
    for (const v1::Shape& shape : response->shapes()) found.shapes.push_back(fromWire(shape));
    found.missing.assign(response->missing().begin(), response->missing().end());
    return found;
}

namespace {

Result<Preview> previewOf(const v1::Preview& message) {
    Preview preview;
    preview.key = message.key();
    preview.version = message.version();
    RETURN_IF_ERROR(unpackPoints(message.xyz(), {}, preview.points));
    const std::string& normals = message.normals();
    for (std::size_t i = 0; i + 2 < normals.size(); i += 3) {
        const auto part = [&](std::size_t axis) {
            return static_cast<signed char>(normals[i + axis]) / 127.0;
        };
        preview.normals.push_back({part(0), part(1), part(2)});
    }
    return preview;
}

}  // namespace

Result<std::vector<Preview>> Client::getPreviews(const std::string& collection,
                                                 const std::vector<std::string>& keys,
                                                 std::uint32_t mostPoints, const RunContext& context) const {
    v1::GetPreviewsRequest request;
    request.set_collection(collection);
    request.mutable_keys()->Add(keys.begin(), keys.end());
    request.set_max_points(mostPoints);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::GetPreviews, request);
    RETURN_IF_ERROR(response);
    std::vector<Preview> previews;
    for (const v1::Preview& message : response->previews()) {
        auto preview = previewOf(message);
        RETURN_IF_ERROR(preview);
        previews.push_back(std::move(*preview));
    }
    return previews;
}

namespace {

/// Of one shape. `take(origin, xyz)` gets the bytes of the points, chunk after chunk.
template <typename Take>
Result<Shape> readPoints(grpc::ClientReader<v1::StoredPoints>& stream, const RunContext& context,
                         Take&& take) {
    Sha256 hash;
    Shape shape;
    std::uint64_t count = 0;
    v1::StoredPoints message;
    while (stream.Read(&message)) {
        if (message.has_shape()) {
            shape = fromWire(message.shape());
        } else if (message.has_chunk()) {
            const std::string& xyz = message.chunk().xyz();
            hash.update(xyz.data(), xyz.size());
            count += xyz.size() / kPointBytes;
            RETURN_IF_ERROR(take(shape.origin, xyz));
            context.report("download", count, shape.pointCount);
        }
    }
    const Sha256Digest digest = hash.finish();
    // After an error of the call its status says why there is less, or nothing.
    if (count != 0 && count == shape.pointCount &&
        shape.sha256 != std::string(digest.begin(), digest.end())) {
        return fail(ErrorCode::kChecksumMismatch,
                    "the points of '" + shape.key + "' were damaged in transfer: ask for them again");
    }
    return shape;
}

/// Calls GetPoints; before each try `clear()`. Errors: kCountMismatch, those of readPoints and `take`.
template <typename Clear, typename Take>
Result<Shape> getStoredPoints(const ClientOptions& options, v1::ShapeService::Stub& stub, const ShapeRef& ref,
                              const RunContext& context, Clear&& clear, Take&& take) {
    v1::GetPointsRequest request;
    fill(ref, request.mutable_shape());
    Shape shape;
    std::uint64_t bytes = 0;
    const auto made =
        makeCall(options, context, kIdempotent, &request, [&](grpc::ClientContext& rpc, Result<void>& local) {
            clear();
            bytes = 0;
            const auto stream = stub.GetPoints(&rpc, request);
            auto read = readPoints(*stream, context, [&](const Point3& origin, const std::string& xyz) {
                bytes += xyz.size();
                return take(origin, xyz);
            });
            if (read) {
                shape = std::move(*read);
            } else {
                local = fail(read.error());
                rpc.TryCancel();
            }
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    if (bytes != shape.pointCount * kPointBytes) {
        return fail(ErrorCode::kCountMismatch, "the server sent " + std::to_string(bytes / kPointBytes) +
                                                   " of " + std::to_string(shape.pointCount) + " points");
    }
    return shape;
}

}  // namespace

Result<StoredPoints> Client::getPoints(const ShapeRef& shape, const RunContext& context) const {
    StoredPoints scan;
    auto stored = getStoredPoints(
        impl_->options, *impl_->shapes, shape, context, [&] { scan.points.clear(); },
        [&](const Point3& origin, const std::string& xyz) { return unpackPoints(xyz, origin, scan.points); });
    RETURN_IF_ERROR(stored);
    scan.shape = std::move(*stored);
    return scan;
}

Result<AddReply> Client::copyShape(const ShapeRef& shape, const Client& to, const ShapeRef& as,
                                   const RunContext& context) const {
    PackedPoints packed;
    const auto stored = getStoredPoints(
        impl_->options, *impl_->shapes, shape, context, [&] { packed.bytes.clear(); },
        [&](const Point3&, const std::string& xyz) {
            packed.bytes += xyz;
            return Result<void>();
        });
    RETURN_IF_ERROR(stored);
    packed.count = stored->pointCount;
    packed.sha256 = stored->sha256;
    packed.origin = stored->origin;
    AddRequest request;
    request.shape = as;
    request.metadata = stored->metadata;
    return to.impl_->add(request, packed, context);
}

Result<ListPage> Client::listShapes(const ListRequest& list, const RunContext& context) const {
    v1::ListShapesRequest request;
    request.set_collection(list.collection);
    request.set_filter(list.filter);
    request.set_state(toWire(list.state));
    request.set_page_size(list.pageSize);
    request.set_cursor(list.cursor);
    request.set_key_prefix(list.keyPrefix);
    request.set_order(toWire(list.order));
    request.set_descending(list.descending);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::ListShapes, request);
    RETURN_IF_ERROR(response);
    ListPage page;
    for (const v1::Shape& shape : response->shapes()) page.shapes.push_back(fromWire(shape));
    page.nextCursor = response->next_cursor();
    return page;
}

Result<std::uint64_t> Client::countShapes(const ListRequest& list, const RunContext& context) const {
    v1::CountShapesRequest request;
    request.set_collection(list.collection);
    request.set_filter(list.filter);
    request.set_state(toWire(list.state));
    request.set_key_prefix(list.keyPrefix);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::CountShapes, request);
    RETURN_IF_ERROR(response);
    return response->count();
}

Result<ValueCounts> Client::countByValue(const ValueCountRequest& count, const RunContext& context) const {
    v1::CountByValueRequest request;
    request.set_collection(count.collection);
    request.set_metadata_key(count.metadataKey);
    request.set_filter(count.filter);
    request.set_state(toWire(count.state));
    request.set_max_values(count.maxValues);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::CountByValue, request);
    RETURN_IF_ERROR(response);
    ValueCounts counts;
    for (const auto& one : response->values()) counts.values.push_back({one.value(), one.shapes()});
    counts.otherValues = response->other_values();
    counts.otherShapes = response->other_shapes();
    counts.without = response->shapes_without();
    return counts;
}

Result<Shape> Client::deleteShape(const ShapeRef& shape, std::optional<std::int64_t> expectedVersion,
                                  const RunContext& context) const {
    v1::DeleteShapeRequest request;
    fill(shape, request.mutable_shape());
    if (expectedVersion) request.set_expected_version(*expectedVersion);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->shapes,
                                    &v1::ShapeService::Stub::DeleteShape, request);
    RETURN_IF_ERROR(response);
    return shapeOf(*response);
}

Result<IngestEvent> Client::watchIngest(const ShapeRef& shape,
                                        const std::function<void(const IngestEvent&)>& onEvent,
                                        const RunContext& context) const {
    v1::WatchIngestRequest request;
    fill(shape, request.mutable_shape());
    IngestEvent last;
    const auto made = makeCall(impl_->options, context, kIdempotentUnbounded, &request,
                               [&](grpc::ClientContext& rpc, Result<void>&) {
                                   const auto stream = impl_->shapes->WatchIngest(&rpc, request);
                                   v1::IngestEvent event;
                                   while (stream->Read(&event)) {
                                       last = fromWire(event);
                                       if (onEvent) onEvent(last);
                                   }
                                   return stream->Finish();
                               });
    RETURN_IF_ERROR(made);
    return last;
}

Result<Signature> Client::getSignature(const ShapeRef& shape, const RunContext& context) const {
    v1::GetSignatureRequest request;
    fill(shape, request.mutable_shape());
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::GetSignature, request);
    RETURN_IF_ERROR(response);
    return fromWire(response->signature());
}

Result<SegmentedScan> Client::getSegments(const ShapeRef& shape, const RunContext& context) const {
    v1::GetSegmentsRequest request;
    fill(shape, request.mutable_shape());
    SegmentedScan scan;
    const auto made = makeCall(impl_->options, context, kIdempotent, &request,
                               [&](grpc::ClientContext& rpc, Result<void>& local) {
                                   scan = {};
                                   const auto stream = impl_->shapes->GetSegments(&rpc, request);
                                   local = readSegments(*stream, scan, context);
                                   if (!local) rpc.TryCancel();
                                   return stream->Finish();
                               });
    RETURN_IF_ERROR(made);
    return scan;
}

Result<SegmentedScan> Client::segment(const PointCloud& points, const Parameters& parameters,
                                      bool summaryOnly, const RunContext& context) const {
    const auto packed = packPoints(points);
    RETURN_IF_ERROR(packed);
    v1::SegmentRequest request;
    v1::SegmentHeader* header = request.mutable_header();
    fill(*packed, header);
    header->set_summary_only(summaryOnly);
    fillParameters(parameters, header);
    SegmentedScan scan;
    const auto made = makeCall(impl_->options, context, kIdempotent, &request,
                               [&](grpc::ClientContext& rpc, Result<void>& local) {
                                   scan = {};
                                   const auto stream = impl_->shapes->Segment(&rpc);
                                   writeScan(*stream, request, *packed, context);
                                   local = readSegments(*stream, scan, context);
                                   if (!local) rpc.TryCancel();
                                   return stream->Finish();
                               });
    RETURN_IF_ERROR(made);
    return scan;
}

}  // namespace shapedb::client
