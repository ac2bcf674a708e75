// SPDX-License-Identifier: GPL-3.0-or-later
// shapedb.v1.AdminService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/request.h"
#include "server/rpc/services.h"
#include "shapedb/v1/admin_service.grpc.pb.h"

namespace shapedb::rpc {

class Call;

/// Thread-safe. `services` must outlive it.
class AdminServiceHandler final : public ReadsRequests<v1::AdminService> {
  public:
    explicit AdminServiceHandler(const Services& services);

    grpc::Status rebuild(grpc::ServerContext* context, Request<v1::RebuildRequest>& request,
                         Replies<v1::RebuildProgress>* writer);
    grpc::Status cancelRebuild(grpc::ServerContext* context, Request<v1::CancelRebuildRequest>& request,
                               v1::CancelRebuildResponse* response);
    grpc::Status backup(grpc::ServerContext* context, Request<v1::BackupRequest>& request,
                        Replies<v1::BackupChunk>* writer);
    grpc::Status restore(grpc::ServerContext* context, Upload<v1::BackupChunk>& chunks,
                         v1::RestoreResponse* response);
    grpc::Status exportCollection(grpc::ServerContext* context, Request<v1::ExportCollectionRequest>& request,
                                  Replies<v1::BackupChunk>* writer);
    grpc::Status importCollection(grpc::ServerContext* context, Upload<v1::ImportCollectionRequest>& messages,
                                  v1::ImportCollectionResponse* response);
    grpc::Status check(grpc::ServerContext* context, Request<v1::CheckRequest>& request,
                       Replies<v1::CheckProgress>* writer);
    grpc::Status stats(grpc::ServerContext* context, Request<v1::StatsRequest>& request,
                       v1::StatsResponse* response);
    grpc::Status serverInfo(grpc::ServerContext* context, Request<v1::ServerInfoRequest>& request,
                            v1::ServerInfoResponse* response);
    grpc::Status createKey(grpc::ServerContext* context, Request<v1::CreateKeyRequest>& request,
                           v1::CreateKeyResponse* response);
    grpc::Status listKeys(grpc::ServerContext* context, Request<v1::ListKeysRequest>& request,
                          v1::ListKeysResponse* response);
    grpc::Status revokeKey(grpc::ServerContext* context, Request<v1::RevokeKeyRequest>& request,
                           v1::RevokeKeyResponse* response);

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
