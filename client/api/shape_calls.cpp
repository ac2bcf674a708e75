// ShapeService.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "client/api/packing.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

v1::AddShapeRequest addHeader(const AddRequest& request, const PackedPoints& packed) {
    v1::AddShapeRequest message;
    v1::AddShapeHeader* header = message.mutable_header();
    header->set_collection(request.shape.collection);
    header->set_key(request.shape.key);
    header->set_mode(toWire(request.mode));
    header->mutable_metadata()->insert(request.metadata.begin(), request.metadata.end());
    if (packed.offset != Point3{}) (*header->mutable_metadata())[kOffsetKey] = offsetText(packed.offset);
    if (request.expectedVersion) header->set_expected_version(*request.expectedVersion);
    header->set_point_count(packed.count);
    header->set_sha256(packed.sha256);
    header->set_wait(request.wait);
    return message;
}

/// Reads the reply of GetSegments or Segment.
template <typename Stream>
Result<void> readSegments(Stream& stream, SegmentedScan& scan, const RunContext& context) {
    v1::SegmentedPoints message;
    while (stream.Read(&message)) {
        if (message.has_summary()) {
            scan.report = fromWire(message.summary().report());
            scan.signature = fromWire(message.summary().signature());
        } else if (message.has_chunk()) {
            const v1::LabelledChunk& chunk = message.chunk();
            RETURN_IF_ERROR(unpackPoints(chunk.xyz(), scan.points));
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
    const v1::AddShapeRequest header = addHeader(request, *packed);
    const CallTraits traits{!request.expectedVersion.has_value(), !request.wait};
    v1::AddShapeResponse response;
    const auto made = makeCall(impl_->options, context, traits, [&](grpc::ClientContext& rpc, Result<void>&) {
        response.Clear();
        const auto stream = impl_->shapes->AddShape(&rpc, &response);
        writeScan(*stream, header, *packed, context);
        return stream->Finish();
    });
    RETURN_IF_ERROR(made);
    return AddReply{fromWire(response.outcome()), fromWire(response.shape()), packed->offset};
}

Result<Shape> Client::getShape(const ShapeRef& shape, const RunContext& context) const {
    v1::GetShapeRequest request;
    fill(shape, request.mutable_shape());
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::GetShape, request);
    RETURN_IF_ERROR(response);
    return fromWire(response->shape());
}

Result<ListPage> Client::listShapes(const ListRequest& list, const RunContext& context) const {
    v1::ListShapesRequest request;
    request.set_collection(list.collection);
    request.set_filter(list.filter);
    request.set_state(toWire(list.state));
    request.set_page_size(list.pageSize);
    request.set_cursor(list.cursor);
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
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::CountShapes, request);
    RETURN_IF_ERROR(response);
    return response->count();
}

Result<Shape> Client::deleteShape(const ShapeRef& shape, std::optional<std::int64_t> expectedVersion,
                                  const RunContext& context) const {
    v1::DeleteShapeRequest request;
    fill(shape, request.mutable_shape());
    if (expectedVersion) request.set_expected_version(*expectedVersion);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->shapes,
                                    &v1::ShapeService::Stub::DeleteShape, request);
    RETURN_IF_ERROR(response);
    return fromWire(response->shape());
}

Result<IngestEvent> Client::watchIngest(const ShapeRef& shape,
                                        const std::function<void(const IngestEvent&)>& onEvent,
                                        const RunContext& context) const {
    v1::WatchIngestRequest request;
    fill(shape, request.mutable_shape());
    IngestEvent last;
    const auto made =
        makeCall(impl_->options, context, kIdempotentUnbounded, [&](grpc::ClientContext& rpc, Result<void>&) {
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
    const auto made =
        makeCall(impl_->options, context, kIdempotent, [&](grpc::ClientContext& rpc, Result<void>& local) {
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
    header->set_point_count(packed->count);
    header->set_sha256(packed->sha256);
    header->set_summary_only(summaryOnly);
    fillParameters(parameters, header);
    SegmentedScan scan;
    const auto made =
        makeCall(impl_->options, context, kIdempotent, [&](grpc::ClientContext& rpc, Result<void>& local) {
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
