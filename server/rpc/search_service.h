// shapedb.v1.SearchService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/sync_stream.h>

#include "server/rpc/services.h"
#include "shapedb/v1/search_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class SearchServiceHandler final : public shapedb::v1::SearchService::Service {
  public:
    explicit SearchServiceHandler(const Services& services);

    grpc::Status SearchByKey(grpc::ServerContext* context, const v1::SearchByKeyRequest* request,
                             v1::SearchResponse* response) override;
    grpc::Status SearchByScan(grpc::ServerContext* context,
                              grpc::ServerReader<v1::SearchByScanRequest>* reader,
                              v1::SearchResponse* response) override;
    grpc::Status SearchBySignature(grpc::ServerContext* context, const v1::SearchBySignatureRequest* request,
                                   v1::SearchResponse* response) override;
    grpc::Status Compare(grpc::ServerContext* context, const v1::CompareRequest* request,
                         v1::CompareResponse* response) override;

  private:
    using BatchStream = grpc::ServerUnaryStreamer<v1::SearchBatchRequest, grpc::ByteBuffer>;

    /// SearchBatch, with an answer that is encoded already.
    grpc::Status searchBatch(grpc::ServerContext* context, BatchStream& stream);

    const Services& services_;
};

}  // namespace shapedb::rpc
