// SPDX-License-Identifier: Apache-2.0
// What a failed call means: its Error, and whether and when to retry. Decisions only; call.h does the
// waiting.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include <grpcpp/grpcpp.h>

#include "client/api/client.h"
#include "core/base/error.h"
#include "core/base/random.h"

namespace shapedb::client {

struct AttemptFailure {
    ErrorCode code = ErrorCode::kInternal;
    /// Trailing metadata `grpc-retry-pushback-ms`: how long to wait. Negative or not a number: do not retry
    /// (gRFC A6).
    std::optional<std::string> pushback;
};

/// How long to wait before the next try; nothing if the failure is final. `attempt` counts the failures in a
/// row for this reason, from 1. Advances `random`.
[[nodiscard]] std::optional<std::chrono::milliseconds> retryDelay(const RetryPolicy& policy, int attempt,
                                                                  const AttemptFailure& failure,
                                                                  Random& random);

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const RetryPolicy& policy);

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
