// shapedb.v1.ShapeService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/services.h"
#include "shapedb/v1/shape_service.grpc.pb.h"

namespace shapedb::rpc {

class Call;

/// Thread-safe. `services` must outlive it.
class ShapeServiceHandler final : public shapedb::v1::ShapeService::Service {
  public:
    explicit ShapeServiceHandler(const Services& services) : services_(services) {}

    grpc::Status AddShape(grpc::ServerContext* context, grpc::ServerReader<v1::AddShapeRequest>* reader,
                          v1::AddShapeResponse* response) override;
    grpc::Status GetShape(grpc::ServerContext* context, const v1::GetShapeRequest* request,
                          v1::GetShapeResponse* response) override;
    grpc::Status GetShapes(grpc::ServerContext* context, const v1::GetShapesRequest* request,
                           v1::GetShapesResponse* response) override;
    grpc::Status GetPoints(grpc::ServerContext* context, const v1::GetPointsRequest* request,
                           grpc::ServerWriter<v1::StoredPoints>* writer) override;
    grpc::Status GetPreviews(grpc::ServerContext* context, const v1::GetPreviewsRequest* request,
                             v1::GetPreviewsResponse* response) override;
    grpc::Status ListShapes(grpc::ServerContext* context, const v1::ListShapesRequest* request,
                            v1::ListShapesResponse* response) override;
    grpc::Status CountShapes(grpc::ServerContext* context, const v1::CountShapesRequest* request,
                             v1::CountShapesResponse* response) override;
    grpc::Status CountByValue(grpc::ServerContext* context, const v1::CountByValueRequest* request,
                              v1::CountByValueResponse* response) override;
    grpc::Status DeleteShape(grpc::ServerContext* context, const v1::DeleteShapeRequest* request,
                             v1::DeleteShapeResponse* response) override;
    grpc::Status DeleteShapes(grpc::ServerContext* context, const v1::DeleteShapesRequest* request,
                              v1::DeleteShapesResponse* response) override;
    grpc::Status UpdateMetadata(grpc::ServerContext* context, const v1::UpdateMetadataRequest* request,
                                v1::UpdateMetadataResponse* response) override;
    grpc::Status RetryShapes(grpc::ServerContext* context, const v1::RetryShapesRequest* request,
                             v1::RetryShapesResponse* response) override;
    grpc::Status WatchIngest(grpc::ServerContext* context, const v1::WatchIngestRequest* request,
                             grpc::ServerWriter<v1::IngestEvent>* writer) override;
    grpc::Status GetSignature(grpc::ServerContext* context, const v1::GetSignatureRequest* request,
                              v1::GetSignatureResponse* response) override;
    grpc::Status GetSegments(grpc::ServerContext* context, const v1::GetSegmentsRequest* request,
                             grpc::ServerWriter<v1::SegmentedPoints>* writer) override;
    grpc::Status Segment(grpc::ServerContext* context,
                         grpc::ServerReaderWriter<v1::SegmentedPoints, v1::SegmentRequest>* stream) override;

  private:
    Result<void> addShape(Call& call, grpc::ServerReader<v1::AddShapeRequest>& reader,
                          v1::AddShapeResponse& response);
    Result<void> updateMetadata(Call& call, const index::SnapshotPtr& collection,
                                const v1::UpdateMetadataRequest& request,
                                v1::UpdateMetadataResponse& response);

    const Services& services_;
};

}  // namespace shapedb::rpc
