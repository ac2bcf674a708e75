// SPDX-License-Identifier: Apache-2.0
#include "client/api/retry.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/number_text.h"

namespace shapedb::client {

namespace {

/// Empty if the server forbids a retry.
std::optional<std::chrono::milliseconds> parsePushback(const std::string& text) {
    std::int64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || stop != end || value < 0) return std::nullopt;
    return std::chrono::milliseconds(value);
}

/// Tries in all for a call that fails for this reason.
int attemptsFor(const RetryPolicy& policy, ErrorCode code) {
    if (code == ErrorCode::kUnavailable) return policy.maxAttempts;
    return code == ErrorCode::kQueueFull ? policy.maxQueueAttempts : 1;
}

}  // namespace

std::optional<std::chrono::milliseconds> retryDelay(const RetryPolicy& policy, int attempt,
                                                    const AttemptFailure& failure, Random& random) {
    if (attempt >= attemptsFor(policy, failure.code)) return std::nullopt;
    if (failure.pushback) return parsePushback(*failure.pushback);
    const double longest = static_cast<double>(policy.maxBackoff.count());
    const double backoff = std::min(longest, static_cast<double>(policy.initialBackoff.count()) *
                                                 std::pow(policy.multiplier, attempt - 1));
    const double jittered = backoff * random.uniform(1.0 - policy.jitter, 1.0 + policy.jitter);
    return std::chrono::milliseconds(std::llround(jittered));
}

Result<void> validate(const RetryPolicy& policy) {
    const auto invalid = [](const std::string& field, const std::string& value, const std::string& range) {
        return fail(ErrorCode::kInvalidArgument, "retry." + field + " is " + value + "; it must be " + range);
    };
    if (policy.maxAttempts < 1)
        return invalid("maxAttempts", std::to_string(policy.maxAttempts), "at least 1");
    if (policy.maxQueueAttempts < 1) {
        return invalid("maxQueueAttempts", std::to_string(policy.maxQueueAttempts), "at least 1");
    }
    if (policy.initialBackoff.count() < 0) {
        return invalid("initialBackoff", std::to_string(policy.initialBackoff.count()) + " ms", "at least 0");
    }
    if (policy.maxBackoff.count() < 0) {
        return invalid("maxBackoff", std::to_string(policy.maxBackoff.count()) + " ms", "at least 0");
    }
    if (!(policy.multiplier >= 1.0) || !std::isfinite(policy.multiplier)) {
        return invalid("multiplier", numberText(policy.multiplier), "finite and at least 1");
    }
    if (!(policy.jitter >= 0.0 && policy.jitter <= 1.0)) {
        return invalid("jitter", numberText(policy.jitter), "in [0, 1]");
    }
    return {};
}

}  // namespace shapedb::client
