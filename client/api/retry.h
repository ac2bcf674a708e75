// When and how soon a failed call is made again. Pure decisions; call.h does the waiting.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "client/api/client.h"
#include "core/base/error.h"
#include "core/base/random.h"

namespace shapedb::client {

/// What a failed attempt leaves to decide by.
struct AttemptFailure {
    ErrorCode code = ErrorCode::kInternal;
    /// Trailing metadata `grpc-retry-pushback-ms`: how long to wait; negative or not a number
    /// means "do not try again" (gRFC A6).
    std::optional<std::string> pushback;
};

/// How long to wait before the next try, or nothing when the failure is final. `attempt` says how
/// many tries in a row have now failed for this reason, from 1. Advances `random`.
[[nodiscard]] std::optional<std::chrono::milliseconds> retryDelay(const RetryPolicy& policy, int attempt,
                                                                  const AttemptFailure& failure,
                                                                  Random& random);

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const RetryPolicy& policy);

}  // namespace shapedb::client
