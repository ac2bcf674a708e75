// SPDX-License-Identifier: Apache-2.0
// From the status of a gRPC call to an Error.
#pragma once

#include <map>
#include <string>

#include <grpcpp/grpcpp.h>

#include "client/api/retry.h"
#include "core/base/error.h"

namespace shapedb::client {

using TrailingMetadata = std::multimap<grpc::string_ref, grpc::string_ref>;

/// Whom a call was made to.
struct Peer {
    std::string address;
    bool tls = false;

    [[nodiscard]] std::string name() const { return address + (tls ? " with TLS" : ""); }
};

/// The error of a failed call. Its code is the one the server names in the trailing metadata `shapedb-error`;
/// without that (a proxy answered, there was no reply, or the server cut the call off) it follows from the
/// gRPC code. `peer` is for the message.
[[nodiscard]] Error errorOf(const grpc::Status& status, const TrailingMetadata& trailing, const Peer& peer);

/// The same failure for retryDelay. RESOURCE_EXHAUSTED from elsewhere than the server's queue (a message too
/// large, a proxy's quota) is final unless it says when to come back.
[[nodiscard]] AttemptFailure failureOf(const grpc::Status& status, const TrailingMetadata& trailing,
                                       const Error& error);

}  // namespace shapedb::client
