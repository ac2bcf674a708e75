// SPDX-License-Identifier: GPL-3.0-or-later
// shapedb.v1.CollectionService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/request.h"
#include "server/rpc/services.h"
#include "shapedb/v1/collection_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class CollectionServiceHandler final : public ReadsRequests<v1::CollectionService> {
  public:
    explicit CollectionServiceHandler(const Services& services);

    grpc::Status createCollection(grpc::ServerContext* context, Request<v1::CreateCollectionRequest>& request,
                                  v1::Collection* response);
    grpc::Status getCollection(grpc::ServerContext* context, Request<v1::GetCollectionRequest>& request,
                               v1::Collection* response);
    grpc::Status listCollections(grpc::ServerContext* context, Request<v1::ListCollectionsRequest>& request,
                                 v1::ListCollectionsResponse* response);
    grpc::Status renameCollection(grpc::ServerContext* context, Request<v1::RenameCollectionRequest>& request,
                                  v1::Collection* response);
    grpc::Status setAlias(grpc::ServerContext* context, Request<v1::SetAliasRequest>& request,
                          v1::Collection* response);
    grpc::Status deleteAlias(grpc::ServerContext* context, Request<v1::DeleteAliasRequest>& request,
                             v1::DeleteAliasResponse* response);
    grpc::Status deleteCollection(grpc::ServerContext* context, Request<v1::DeleteCollectionRequest>& request,
                                  v1::DeleteCollectionResponse* response);

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
