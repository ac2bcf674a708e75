// SPDX-License-Identifier: GPL-3.0-or-later
// A ShapeDB server inside the test process, with scripted answers.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "client/api/client.h"
#include "shapedb/v1/admin_service.grpc.pb.h"
#include "shapedb/v1/search_service.grpc.pb.h"
#include "shapedb/v1/shape_service.grpc.pb.h"

namespace shapedb::client {

/// Answers a call; `call` counts the calls of this rpc from 1.
using Answer = std::function<grpc::Status(grpc::ServerContext& context, int call)>;

/// Fails with an error name in the trailing metadata, as shapedbd does.
[[nodiscard]] grpc::Status namedError(grpc::ServerContext& context, grpc::StatusCode code, const char* name,
                                      const char* message);

class FakeShapes final : public v1::ShapeService::Service {
  public:
    grpc::Status GetShape(grpc::ServerContext* context, const v1::GetShapeRequest* request,
                          v1::GetShapeResponse* response) override;
    grpc::Status DeleteShape(grpc::ServerContext* context, const v1::DeleteShapeRequest* request,
                             v1::DeleteShapeResponse* response) override;
    grpc::Status AddShape(grpc::ServerContext* context, grpc::ServerReader<v1::AddShapeRequest>* reader,
                          v1::AddShapeResponse* response) override;
    grpc::Status WatchIngest(grpc::ServerContext* context, const v1::WatchIngestRequest* request,
                             grpc::ServerWriter<v1::IngestEvent>* writer) override;
    grpc::Status Segment(grpc::ServerContext* context,
                         grpc::ServerReaderWriter<v1::SegmentedPoints, v1::SegmentRequest>* stream) override;

    Answer answer = [](grpc::ServerContext&, int) { return grpc::Status::OK; };
    std::atomic<int> calls{0};

    std::int64_t change = 0;  ///< of every answer that has one
    /// Of the last upload.
    v1::AddShapeHeader header;
    std::string points;
    std::size_t largestChunk = 0;
    /// What Segment and WatchIngest send.
    std::vector<v1::SegmentedPoints> segmented;
    std::vector<v1::IngestEvent> events;
};

class FakeSearch final : public v1::SearchService::Service {
  public:
    grpc::Status SearchByKey(grpc::ServerContext* context, const v1::SearchByKeyRequest* request,
                             v1::SearchResponse* response) override;
    grpc::Status SearchBatch(grpc::ServerContext* context, const v1::SearchBatchRequest* request,
                             v1::SearchBatchResponse* response) override;

    v1::SearchOptions options;  ///< of the last call
    v1::SearchResponse answer;  ///< to each query
};

class FakeAdmin final : public v1::AdminService::Service {
  public:
    grpc::Status Backup(grpc::ServerContext* context, const v1::BackupRequest* request,
                        grpc::ServerWriter<v1::BackupChunk>* writer) override;
    grpc::Status Restore(grpc::ServerContext* context, grpc::ServerReader<v1::BackupChunk>* reader,
                         v1::RestoreResponse* response) override;
    grpc::Status ExportCollection(grpc::ServerContext* context, const v1::ExportCollectionRequest* request,
                                  grpc::ServerWriter<v1::BackupChunk>* writer) override;
    grpc::Status ImportCollection(grpc::ServerContext* context,
                                  grpc::ServerReader<v1::ImportCollectionRequest>* reader,
                                  v1::ImportCollectionResponse* response) override;

    std::string exported;                               ///< the name asked for
    std::vector<v1::ImportCollectionRequest> imported;  ///< as received
    v1::BackupRequest backupRequest;                    ///< the last one
    std::vector<v1::BackupChunk> backup;
    grpc::Status backupStatus;
    std::vector<v1::BackupChunk> restored;
    std::size_t restoreTakes = 1'000'000;  ///< chunks, before it fails with restoreStatus
    grpc::Status restoreStatus;
};

class FakeServer {
  public:
    FakeServer();
    ~FakeServer();

    /// With waits between retries short enough for a test.
    [[nodiscard]] Client client(int maxAttempts = 4) const;
    [[nodiscard]] const std::string& address() const { return address_; }

    FakeShapes shapes;
    FakeSearch search;
    FakeAdmin admin;

  private:
    std::string address_;
    std::unique_ptr<grpc::Server> server_;
};

}  // namespace shapedb::client
