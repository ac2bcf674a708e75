// shapedb.v1.SearchService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/services.h"
#include "shapedb/v1/search_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class SearchServiceHandler final : public shapedb::v1::SearchService::Service {
  public:
    explicit SearchServiceHandler(const Services& services) : services_(services) {}

    grpc::Status SearchByKey(grpc::ServerContext* context, const v1::SearchByKeyRequest* request,
                             v1::SearchResponse* response) override;
    grpc::Status SearchByScan(grpc::ServerContext* context,
                              grpc::ServerReader<v1::SearchByScanRequest>* reader,
                              v1::SearchResponse* response) override;
    grpc::Status SearchBySignature(grpc::ServerContext* context, const v1::SearchBySignatureRequest* request,
                                   v1::SearchResponse* response) override;
    grpc::Status SearchBatch(grpc::ServerContext* context, const v1::SearchBatchRequest* request,
                             v1::SearchBatchResponse* response) override;
    grpc::Status Compare(grpc::ServerContext* context, const v1::CompareRequest* request,
                         v1::CompareResponse* response) override;

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
