// SPDX-License-Identifier: GPL-3.0-or-later
// shapedb.v1.AlignService over gRPC: validate, convert, call the catalog, convert back.
#pragma once

#include "server/rpc/services.h"
#include "shapedb/v1/align_service.grpc.pb.h"

namespace shapedb::rpc {

/// Thread-safe. `services` must outlive it.
class AlignServiceHandler final : public shapedb::v1::AlignService::Service {
  public:
    explicit AlignServiceHandler(const Services& services) : services_(services) {}

    grpc::Status Align(grpc::ServerContext* context, grpc::ServerReader<v1::AlignRequest>* reader,
                       v1::AlignResponse* response) override;

  private:
    const Services& services_;
};

}  // namespace shapedb::rpc
