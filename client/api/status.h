// From the outcome of a gRPC call to an Error with the server's own name for it.
#pragma once

#include <map>
#include <string>

#include <grpcpp/grpcpp.h>

#include "client/api/retry.h"
#include "core/base/error.h"

namespace shapedb::client {

using TrailingMetadata = std::multimap<grpc::string_ref, grpc::string_ref>;

/// The error of a call that failed. The server's name of the error (trailing metadata
/// `shapedb-error`) decides the code; without one, as from a proxy or when nothing answered, the
/// gRPC code does. `address` is named when the server could not be reached.
[[nodiscard]] Error errorOf(const grpc::Status& status, const TrailingMetadata& trailing,
                            const std::string& address);

/// What retryDelay needs of the same call. A RESOURCE_EXHAUSTED that is not the server's own full
/// queue (a message too large, a proxy's quota) stays final unless it says when to come back.
[[nodiscard]] AttemptFailure failureOf(const grpc::Status& status, const TrailingMetadata& trailing,
                                       const Error& error);

}  // namespace shapedb::client
