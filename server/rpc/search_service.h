// SPDX-License-Identifier: GPL-3.0-or-later
// shapedb.v1.SearchService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include "core/base/run_context.h"
#include "server/rpc/call.h"
#include "server/rpc/request.h"
#include "server/rpc/services.h"
#include "shapedb/v1/search_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class SearchServiceHandler final : public ReadsRequests<v1::SearchService> {
  public:
    explicit SearchServiceHandler(const Services& services);

    grpc::Status searchByKey(grpc::ServerContext* context, Request<v1::SearchByKeyRequest>& request,
                             v1::SearchResponse* response);
    grpc::Status searchByScan(grpc::ServerContext* context, Upload<v1::SearchByScanRequest>& messages,
                              v1::SearchResponse* response);
    grpc::Status searchByScanInStages(grpc::ServerContext* context, Upload<v1::SearchByScanRequest>& messages,
                                      UploadReplies<v1::SearchByScanEvent>* writer);
    grpc::Status searchBySignature(grpc::ServerContext* context,
                                   Request<v1::SearchBySignatureRequest>& request,
                                   v1::SearchResponse* response);
    grpc::Status compare(grpc::ServerContext* context, Request<v1::CompareRequest>& request,
                         v1::CompareResponse* response);

  private:
    /// `running`: the context of the search, once the scan has arrived.
    Result<void> receiveAndSearch(Call& call, Upload<v1::SearchByScanRequest>& messages,
                                  const RunContext& running, v1::SearchResponse& response);
    /// The answer is encoded already.
    grpc::Status searchBatch(grpc::ServerContext* context, Request<v1::SearchBatchRequest>& request,
                             grpc::ByteBuffer* response);

    const Services& services_;
};

}  // namespace shapedb::rpc
