// SPDX-License-Identifier: GPL-3.0-or-later
// shapedb.v1.ShapeService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/request.h"
#include "server/rpc/services.h"
#include "shapedb/v1/shape_service.grpc.pb.h"

namespace shapedb::rpc {

class Call;

/// Thread-safe. `services` must outlive it.
class ShapeServiceHandler final : public ReadsRequests<v1::ShapeService> {
  public:
    explicit ShapeServiceHandler(const Services& services);

    grpc::Status addShape(grpc::ServerContext* context, Upload<v1::AddShapeRequest>& messages,
                          v1::AddShapeResponse* response);
    grpc::Status getShape(grpc::ServerContext* context, Request<v1::GetShapeRequest>& request,
                          v1::GetShapeResponse* response);
    grpc::Status getShapes(grpc::ServerContext* context, Request<v1::GetShapesRequest>& request,
                           v1::GetShapesResponse* response);
    grpc::Status getPoints(grpc::ServerContext* context, Request<v1::GetPointsRequest>& request,
                           Replies<v1::StoredPoints>* writer);
    grpc::Status getPreviews(grpc::ServerContext* context, Request<v1::GetPreviewsRequest>& request,
                             v1::GetPreviewsResponse* response);
    grpc::Status listShapes(grpc::ServerContext* context, Request<v1::ListShapesRequest>& request,
                            v1::ListShapesResponse* response);
    grpc::Status countShapes(grpc::ServerContext* context, Request<v1::CountShapesRequest>& request,
                             v1::CountShapesResponse* response);
    grpc::Status countByValue(grpc::ServerContext* context, Request<v1::CountByValueRequest>& request,
                              v1::CountByValueResponse* response);
    grpc::Status deleteShape(grpc::ServerContext* context, Request<v1::DeleteShapeRequest>& request,
                             v1::DeleteShapeResponse* response);
    grpc::Status deleteShapes(grpc::ServerContext* context, Request<v1::DeleteShapesRequest>& request,
                              v1::DeleteShapesResponse* response);
    grpc::Status updateMetadata(grpc::ServerContext* context, Request<v1::UpdateMetadataRequest>& request,
                                v1::UpdateMetadataResponse* response);
    grpc::Status retryShapes(grpc::ServerContext* context, Request<v1::RetryShapesRequest>& request,
                             v1::RetryShapesResponse* response);
    grpc::Status watchIngest(grpc::ServerContext* context, Request<v1::WatchIngestRequest>& request,
                             Replies<v1::IngestEvent>* writer);
    grpc::Status getSignature(grpc::ServerContext* context, Request<v1::GetSignatureRequest>& request,
                              v1::GetSignatureResponse* response);
    grpc::Status getSegments(grpc::ServerContext* context, Request<v1::GetSegmentsRequest>& request,
                             Replies<v1::SegmentedPoints>* writer);
    grpc::Status segment(grpc::ServerContext* context, Upload<v1::SegmentRequest>& messages,
                         UploadReplies<v1::SegmentedPoints>* writer);

  private:
    Result<void> add(Call& call, Upload<v1::AddShapeRequest>& messages, v1::AddShapeResponse& response);
    Result<void> changeMetadata(Call& call, const index::SnapshotPtr& collection,
                                const v1::UpdateMetadataRequest& request,
                                v1::UpdateMetadataResponse& response);

    const Services& services_;
};

}  // namespace shapedb::rpc
