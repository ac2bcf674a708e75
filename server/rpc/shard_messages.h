// SPDX-License-Identifier: GPL-3.0-or-later
// What servers of a cluster ask each other (server/cluster/shard_query.h) as messages. Scores and motions
// travel as the doubles that they are.
#pragma once

#include <grpcpp/support/status.h>

#include "core/base/error.h"
#include "server/cluster/shard_query.h"
#include "shapedb/internal/v1/shard_service.pb.h"

namespace shapedb::rpc {

namespace shards = shapedb::internal::v1;

void toProto(const cluster::FindRequest& request, shards::FindRequest* out);
void toProto(const cluster::FindAnswer& answer, shards::FindResponse* out);
void toProto(const cluster::FitRequest& request, shards::FitRequest* out);
void toProto(const cluster::FitAnswer& answer, shards::FitResponse* out);

// The way back. Errors: kInvalidArgument (not what toProto makes), kMalformedFilter.
[[nodiscard]] Result<cluster::FindRequest> fromProto(const shards::FindRequest& request);
[[nodiscard]] Result<cluster::FindAnswer> fromProto(const shards::FindResponse& answer);
[[nodiscard]] Result<cluster::FitRequest> fromProto(const shards::FitRequest& request);
[[nodiscard]] Result<cluster::FitAnswer> fromProto(const shards::FitResponse& answer);

/// The status of a call that failed, which names the error, and the error of such a status; one that is not
/// of ours is kUnavailable.
[[nodiscard]] grpc::Status shardStatus(const Error& error);
[[nodiscard]] Error shardError(const grpc::Status& status);

}  // namespace shapedb::rpc
