// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/client/api/fake_server.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace shapedb::client {

grpc::Status namedError(grpc::ServerContext& context, grpc::StatusCode code, const char* name,
                        const char* message) {
    context.AddTrailingMetadata("shapedb-error", name);
    return {code, message};
}

grpc::Status FakeShapes::GetShape(grpc::ServerContext* context, const v1::GetShapeRequest* request,
                                  v1::GetShapeResponse* response) {
    response->mutable_shape()->set_key(request->shape().key());
    response->mutable_shape()->set_collection(request->shape().collection());
    response->set_change(change);
    return answer(*context, ++calls);
}

grpc::Status FakeShapes::DeleteShape(grpc::ServerContext* context, const v1::DeleteShapeRequest*,
                                     v1::DeleteShapeResponse* response) {
    response->set_change(change);
    return answer(*context, ++calls);
}

grpc::Status FakeShapes::AddShape(grpc::ServerContext* context,
                                  grpc::ServerReader<v1::AddShapeRequest>* reader,
                                  v1::AddShapeResponse* response) {
    v1::AddShapeRequest message;
    points.clear();
    largestChunk = 0;
    const int call = ++calls;
    if (const grpc::Status early = answer(*context, call); !early.ok()) return early;
    while (reader->Read(&message)) {
        if (message.has_header()) header = message.header();
        points += message.chunk().xyz();
        largestChunk = std::max(largestChunk, message.chunk().xyz().size());
    }
    response->set_outcome(v1::AddShapeResponse::OUTCOME_CREATED);
    response->mutable_shape()->set_key(header.key());
    response->mutable_shape()->set_state(v1::SHAPE_STATE_PENDING);
    response->set_change(change);
    return grpc::Status::OK;
}

grpc::Status FakeShapes::WatchIngest(grpc::ServerContext* context, const v1::WatchIngestRequest*,
                                     grpc::ServerWriter<v1::IngestEvent>* writer) {
    const int call = ++calls;
    for (const v1::IngestEvent& event : events) writer->Write(event);
    return answer(*context, call);
}

grpc::Status FakeShapes::Segment(grpc::ServerContext* context,
                                 grpc::ServerReaderWriter<v1::SegmentedPoints, v1::SegmentRequest>* stream) {
    v1::SegmentRequest request;
    while (stream->Read(&request)) {
    }
    for (const v1::SegmentedPoints& message : segmented) stream->Write(message);
    return answer(*context, ++calls);
}

grpc::Status FakeSearch::SearchByKey(grpc::ServerContext*, const v1::SearchByKeyRequest* request,
                                     v1::SearchResponse* response) {
    options = request->options();
    *response = answer;
    return grpc::Status::OK;
}

grpc::Status FakeSearch::SearchBatch(grpc::ServerContext*, const v1::SearchBatchRequest* request,
                                     v1::SearchBatchResponse* response) {
    options = request->options();
    for (int i = 0; i < request->queries_size(); ++i) *response->add_responses() = answer;
    return grpc::Status::OK;
}

grpc::Status FakeAdmin::Backup(grpc::ServerContext*, const v1::BackupRequest* request,
                               grpc::ServerWriter<v1::BackupChunk>* writer) {
    backupRequest = *request;
    for (const v1::BackupChunk& chunk : backup) writer->Write(chunk);
    return backupStatus;
}

grpc::Status FakeAdmin::ExportCollection(grpc::ServerContext*, const v1::ExportCollectionRequest* request,
                                         grpc::ServerWriter<v1::BackupChunk>* writer) {
    exported = request->collection();
    for (const v1::BackupChunk& chunk : backup) writer->Write(chunk);
    return backupStatus;
}

grpc::Status FakeAdmin::ImportCollection(grpc::ServerContext*,
                                         grpc::ServerReader<v1::ImportCollectionRequest>* reader,
                                         v1::ImportCollectionResponse* response) {
    v1::ImportCollectionRequest message;
    while (reader->Read(&message)) imported.push_back(message);
    response->set_collection("parts");
    response->set_shapes(7);
    response->set_shapes_pending(2);
    return grpc::Status::OK;
}

grpc::Status FakeAdmin::Restore(grpc::ServerContext*, grpc::ServerReader<v1::BackupChunk>* reader,
                                v1::RestoreResponse* response) {
    restored.clear();
    v1::BackupChunk chunk;
    while (restored.size() < restoreTakes && reader->Read(&chunk)) restored.push_back(chunk);
    response->set_shapes(3);
    return restoreStatus;
}

FakeServer::FakeServer() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&shapes);
    builder.RegisterService(&search);
    builder.RegisterService(&admin);
    server_ = builder.BuildAndStart();
    EXPECT_NE(server_, nullptr);
    address_ = "127.0.0.1:" + std::to_string(port);
}

FakeServer::~FakeServer() { server_->Shutdown(std::chrono::system_clock::now()); }

Client FakeServer::client(int maxAttempts) const {
    ClientOptions options;
    options.address = address_;
    options.retry.maxAttempts = maxAttempts;
    options.retry.initialBackoff = std::chrono::milliseconds(10);
    auto connected = Client::connect(options);
    EXPECT_TRUE(connected);
    return std::move(*connected);
}

}  // namespace shapedb::client
