// SPDX-License-Identifier: Apache-2.0
// Whether and when to retry a failed call. Decisions only; call.h does the waiting.
#pragma once

#include <chrono>
#include <optional>
#include <string>

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

}  // namespace shapedb::client
