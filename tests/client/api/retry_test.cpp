// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/api/retry.h"

#include <limits>

#include <gtest/gtest.h>

namespace shapedb::client {
namespace {

AttemptFailure failure(ErrorCode code, std::optional<std::string> pushback = {}) {
    return {code, std::move(pushback)};
}

TEST(Retry, RetriesOnlyErrorsThatWaitingMayCure) {
    Random random(1);
    for (int i = 0; i <= static_cast<int>(ErrorCode::kInternal); ++i) {
        const auto code = static_cast<ErrorCode>(i);
        const bool again = code == ErrorCode::kUnavailable || code == ErrorCode::kQueueFull;
        EXPECT_EQ(retryDelay({}, 1, failure(code), random).has_value(), again) << errorCodeName(code);
        if (!again) {
            EXPECT_FALSE(retryDelay({}, 1, failure(code, "5"), random)) << errorCodeName(code);
        }
    }
}

TEST(Retry, BackoffGrowsToItsMaximumWithinTheJitter) {
    RetryPolicy policy;
    policy.maxAttempts = 100;
    policy.initialBackoff = std::chrono::milliseconds(100);
    policy.multiplier = 2.0;
    policy.maxBackoff = std::chrono::milliseconds(1000);
    policy.jitter = 0.25;
    Random random(7);
    const double expected[] = {100, 200, 400, 800, 1000, 1000};
    for (int attempt = 1; attempt <= 6; ++attempt) {
        double low = 1e9;
        double high = 0.0;
        for (int i = 0; i < 500; ++i) {
            const auto delay = retryDelay(policy, attempt, failure(ErrorCode::kUnavailable), random);
            ASSERT_TRUE(delay);
            low = std::min(low, static_cast<double>(delay->count()));
            high = std::max(high, static_cast<double>(delay->count()));
        }
        const double middle = expected[attempt - 1];
        EXPECT_GE(low, 0.75 * middle - 1);
        EXPECT_LE(high, 1.25 * middle + 1);
        EXPECT_LT(low, 0.85 * middle) << "the jitter is used";
        EXPECT_GT(high, 1.15 * middle) << "on both sides";
    }
    // The power overflows long before the attempts run out.
    EXPECT_LE(retryDelay(policy, 99, failure(ErrorCode::kUnavailable), random)->count(), 1250);
}

TEST(Retry, EndsAfterTheLastAttempt) {
    RetryPolicy policy;
    policy.maxAttempts = 3;
    policy.maxQueueAttempts = 7;
    Random random(1);
    EXPECT_TRUE(retryDelay(policy, 2, failure(ErrorCode::kUnavailable), random));
    EXPECT_FALSE(retryDelay(policy, 3, failure(ErrorCode::kUnavailable), random));
    EXPECT_TRUE(retryDelay(policy, 6, failure(ErrorCode::kQueueFull, "5"), random));
    EXPECT_FALSE(retryDelay(policy, 7, failure(ErrorCode::kQueueFull, "5"), random));
    policy.maxAttempts = 1;
    EXPECT_FALSE(retryDelay(policy, 1, failure(ErrorCode::kUnavailable), random));
}

TEST(Retry, ServerPushbackReplacesTheBackoff) {
    Random random(1);
    EXPECT_EQ(retryDelay({}, 1, failure(ErrorCode::kQueueFull, "1234"), random)->count(), 1234);
    EXPECT_EQ(retryDelay({}, 1, failure(ErrorCode::kQueueFull, "0"), random)->count(), 0);
    for (const char* never : {"-1", "", "soon", "12x", "99999999999999999999"}) {
        EXPECT_FALSE(retryDelay({}, 1, failure(ErrorCode::kQueueFull, never), random)) << never;
    }
}

TEST(Retry, PolicyIsValidated) {
    EXPECT_TRUE(validate(RetryPolicy{}));
    const auto bad = [](auto change) {
        RetryPolicy policy;
        change(policy);
        const auto valid = validate(policy);
        return !valid && valid.error().code == ErrorCode::kInvalidArgument;
    };
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.maxAttempts = 0; }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.maxQueueAttempts = 0; }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.initialBackoff = std::chrono::milliseconds(-1); }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.maxBackoff = std::chrono::milliseconds(-1); }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.multiplier = 0.5; }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.multiplier = std::numeric_limits<double>::infinity(); }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.jitter = 1.5; }));
    EXPECT_TRUE(bad([](RetryPolicy& p) { p.jitter = std::numeric_limits<double>::quiet_NaN(); }));
}

}  // namespace
}  // namespace shapedb::client
