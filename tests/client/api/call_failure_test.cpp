// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/api/call_failure.h"

#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "common/protocol.h"

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

namespace {

Error translate(grpc::StatusCode code, const TrailingMetadata& trailing = {}) {
    return errorOf(grpc::Status(code, "words"), trailing, {"host:1"});
}

TEST(Status, ServerErrorNameDecidesTheCode) {
    for (int i = 0; i <= static_cast<int>(ErrorCode::kInternal); ++i) {
        const auto code = static_cast<ErrorCode>(i);
        const Error error =
            translate(grpc::StatusCode::INVALID_ARGUMENT, {{"shapedb-error", errorCodeName(code)}});
        EXPECT_EQ(error.code, code);
        EXPECT_EQ(error.message, "words") << "the server's message as it is";
    }
}

TEST(Status, GrpcCodeDecidesWithoutAName) {
    EXPECT_EQ(translate(grpc::StatusCode::NOT_FOUND).code, ErrorCode::kNotFound);
    EXPECT_EQ(translate(grpc::StatusCode::INVALID_ARGUMENT).code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(translate(grpc::StatusCode::UNAVAILABLE).code, ErrorCode::kUnavailable);
    EXPECT_EQ(translate(grpc::StatusCode::DEADLINE_EXCEEDED).code, ErrorCode::kDeadlineExceeded);
    EXPECT_EQ(translate(grpc::StatusCode::UNIMPLEMENTED).code, ErrorCode::kUnavailable);
    EXPECT_EQ(translate(grpc::StatusCode::RESOURCE_EXHAUSTED).code, ErrorCode::kInternal);
    EXPECT_EQ(translate(grpc::StatusCode::UNKNOWN).code, ErrorCode::kInternal);
}

TEST(Status, MessageNamesAnUnreachableServer) {
    for (const auto code : {grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::DEADLINE_EXCEEDED,
                            grpc::StatusCode::UNIMPLEMENTED}) {
        EXPECT_NE(translate(code).message.find("host:1"), std::string::npos);
    }
}

TEST(Status, AStrangerIsNotTriedAgain) {
    const grpc::Status status(grpc::StatusCode::UNIMPLEMENTED, "");
    const Error error = errorOf(status, {}, {"host:1"});
    EXPECT_EQ(failureOf(status, {}, error).code, ErrorCode::kRejected);
    EXPECT_NE(error.message.find("not a ShapeDB server"), std::string::npos) << error.message;
}

TEST(Status, WordsOfGrpcStayInside) {
    const auto message = [](const char* details) {
        return errorOf(grpc::Status(grpc::StatusCode::UNAVAILABLE, details), {}, {"host:1"}).message;
    };
    EXPECT_EQ(message("DNS resolution failed for host:1: C-ares status is not ARES_SUCCESS qtype=AAAA"),
              "cannot reach a server at host:1: its host name cannot be resolved");
    EXPECT_EQ(message("failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:1: Failed to "
                      "connect to remote host: Connection refused"),
              "cannot reach a server at host:1: nothing is listening there; is shapedbd running?");
    EXPECT_NE(message("failed to connect to all addresses; last error: UNAVAILABLE: Failed parsing HTTP/2")
                  .find("is not a ShapeDB server"),
              std::string::npos);
    EXPECT_NE(message("Socket closed").find("it probably wants TLS"), std::string::npos);
    EXPECT_NE(
        message(
            "failed to connect to all addresses; last error: UNKNOWN: unix:/nope: No such file or directory")
            .find("there is no such socket"),
        std::string::npos);
    EXPECT_NE(message("something new").find("(something new)"), std::string::npos) << "nothing is lost";
}

TEST(Status, FaultsOfTlsNameTheirRemedy) {
    const auto message = [](const std::string& details) {
        const grpc::Status status(
            grpc::StatusCode::UNAVAILABLE,
            "failed to connect to all addresses; last error: UNKNOWN: ipv4:1.2.3.4:1: " + details);
        return errorOf(status, {}, {"host:1", true}).message;
    };
    const std::string handshake = "Ssl handshake failed: SSL_ERROR_SSL: error:";
    const std::pair<std::string, std::string> cases[] = {
        {handshake + "0A00010B:SSL routines::wrong version number", "does not speak TLS"},
        {handshake + "0A000086:SSL routines::certificate verify failed", "--tls-ca"},
        {"Peer name host is not in peer certificate", "--server-name"},
        {"Endpoint read failed", "--client-certificate"},
    };
    for (const auto& [details, remedy] : cases) {
        const std::string told = message(details);
        EXPECT_NE(told.find(remedy), std::string::npos) << told;
        EXPECT_NE(told.find("host:1"), std::string::npos) << told;
        for (const char* inner : {"SSL", "UNKNOWN", "peer", "Endpoint"}) {
            EXPECT_EQ(told.find(inner), std::string::npos) << told;
        }
    }
}

TEST(Status, ACallThatTheServerCutOffKeepsItsReason) {
    for (const auto code : {grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::DEADLINE_EXCEEDED}) {
        const grpc::Status status(code, kCutOffPrefix + std::string("too slow"));
        const Error error = errorOf(status, {}, {"host:1"});
        EXPECT_EQ(error.message, "cut off by the server: too slow");
        EXPECT_EQ(error.code, translate(code).code);
    }
}

TEST(Status, ExhaustionWithPushbackIsRetried) {
    const grpc::Status status(grpc::StatusCode::RESOURCE_EXHAUSTED, "full");
    const TrailingMetadata named = {{"shapedb-error", "queue_full"}};
    EXPECT_EQ(failureOf(status, named, errorOf(status, named, {})).code, ErrorCode::kQueueFull);
    const TrailingMetadata hinted = {{"grpc-retry-pushback-ms", "20"}};
    const AttemptFailure failure = failureOf(status, hinted, errorOf(status, hinted, {}));
    EXPECT_EQ(failure.code, ErrorCode::kQueueFull);
    EXPECT_EQ(failure.pushback, "20");
    EXPECT_EQ(failureOf(status, {}, errorOf(status, {}, {})).code, ErrorCode::kInternal)
        << "a message too large";
}

}  // namespace

}  // namespace shapedb::client
