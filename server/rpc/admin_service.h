// shapedb.v1.AdminService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/services.h"
#include "shapedb/v1/admin_service.grpc.pb.h"

namespace shapedb::rpc {

class Call;

/// Thread-safe. `services` must outlive it.
class AdminServiceHandler final : public shapedb::v1::AdminService::Service {
  public:
    explicit AdminServiceHandler(const Services& services) : services_(services) {}

    grpc::Status Rebuild(grpc::ServerContext* context, const v1::RebuildRequest* request,
                         grpc::ServerWriter<v1::RebuildProgress>* writer) override;
    grpc::Status CancelRebuild(grpc::ServerContext* context, const v1::CancelRebuildRequest* request,
                               v1::CancelRebuildResponse* response) override;
    grpc::Status Backup(grpc::ServerContext* context, const v1::BackupRequest* request,
                        grpc::ServerWriter<v1::BackupChunk>* writer) override;
    grpc::Status Restore(grpc::ServerContext* context, grpc::ServerReader<v1::BackupChunk>* reader,
                         v1::RestoreResponse* response) override;
    grpc::Status ExportCollection(grpc::ServerContext* context, const v1::ExportCollectionRequest* request,
                                  grpc::ServerWriter<v1::BackupChunk>* writer) override;
    grpc::Status ImportCollection(grpc::ServerContext* context,
                                  grpc::ServerReader<v1::ImportCollectionRequest>* reader,
                                  v1::ImportCollectionResponse* response) override;
    grpc::Status Check(grpc::ServerContext* context, const v1::CheckRequest* request,
                       grpc::ServerWriter<v1::CheckProgress>* writer) override;
    grpc::Status Stats(grpc::ServerContext* context, const v1::StatsRequest* request,
                       v1::StatsResponse* response) override;
    grpc::Status ServerInfo(grpc::ServerContext* context, const v1::ServerInfoRequest* request,
                            v1::ServerInfoResponse* response) override;
    grpc::Status CreateKey(grpc::ServerContext* context, const v1::CreateKeyRequest* request,
                           v1::CreateKeyResponse* response) override;
    grpc::Status ListKeys(grpc::ServerContext* context, const v1::ListKeysRequest* request,
                          v1::ListKeysResponse* response) override;
    grpc::Status RevokeKey(grpc::ServerContext* context, const v1::RevokeKeyRequest* request,
                           v1::RevokeKeyResponse* response) override;

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
