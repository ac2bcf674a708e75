// SPDX-License-Identifier: GPL-3.0-or-later
// shapedb.v1.AlignService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/request.h"
#include "server/rpc/services.h"
#include "shapedb/v1/align_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class AlignServiceHandler final : public ReadsRequests<v1::AlignService> {
  public:
    explicit AlignServiceHandler(const Services& services);

    grpc::Status align(grpc::ServerContext* context, Upload<v1::AlignRequest>& messages,
                       v1::AlignResponse* response);

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
