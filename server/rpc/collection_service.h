// shapedb.v1.CollectionService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/services.h"
#include "shapedb/v1/collection_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class CollectionServiceHandler final : public shapedb::v1::CollectionService::Service {
  public:
    explicit CollectionServiceHandler(const Services& services) : services_(services) {}

    grpc::Status CreateCollection(grpc::ServerContext* context, const v1::CreateCollectionRequest* request,
                                  v1::Collection* response) override;
    grpc::Status GetCollection(grpc::ServerContext* context, const v1::GetCollectionRequest* request,
                               v1::Collection* response) override;
    grpc::Status ListCollections(grpc::ServerContext* context, const v1::ListCollectionsRequest* request,
                                 v1::ListCollectionsResponse* response) override;
    grpc::Status RenameCollection(grpc::ServerContext* context, const v1::RenameCollectionRequest* request,
                                  v1::Collection* response) override;
    grpc::Status SetAlias(grpc::ServerContext* context, const v1::SetAliasRequest* request,
                          v1::Collection* response) override;
    grpc::Status DeleteAlias(grpc::ServerContext* context, const v1::DeleteAliasRequest* request,
                             v1::DeleteAliasResponse* response) override;
    grpc::Status DeleteCollection(grpc::ServerContext* context, const v1::DeleteCollectionRequest* request,
                                  v1::DeleteCollectionResponse* response) override;

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
