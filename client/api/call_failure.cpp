// SPDX-License-Identifier: Apache-2.0
#include "client/api/call_failure.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/protocol.h"
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

namespace {

std::optional<std::string> valueOf(const TrailingMetadata& trailing, const char* key) {
    const auto found = trailing.find(key);
    if (found == trailing.end()) return std::nullopt;
    return std::string(found->second.data(), found->second.size());
}

ErrorCode codeOf(grpc::StatusCode code) {
    switch (code) {
        case grpc::StatusCode::INVALID_ARGUMENT: return ErrorCode::kInvalidArgument;
        case grpc::StatusCode::OUT_OF_RANGE: return ErrorCode::kPointLimitExceeded;
        case grpc::StatusCode::NOT_FOUND: return ErrorCode::kNotFound;
        case grpc::StatusCode::ALREADY_EXISTS: return ErrorCode::kAlreadyExists;
        case grpc::StatusCode::ABORTED: return ErrorCode::kVersionConflict;
        case grpc::StatusCode::FAILED_PRECONDITION: return ErrorCode::kRejected;
        case grpc::StatusCode::PERMISSION_DENIED: return ErrorCode::kPermissionDenied;
        case grpc::StatusCode::UNAUTHENTICATED: return ErrorCode::kUnauthenticated;
        case grpc::StatusCode::UNAVAILABLE:
        case grpc::StatusCode::UNIMPLEMENTED: return ErrorCode::kUnavailable;  // none of ours, or too old
        case grpc::StatusCode::CANCELLED: return ErrorCode::kCancelled;
        case grpc::StatusCode::DEADLINE_EXCEEDED: return ErrorCode::kDeadlineExceeded;
        case grpc::StatusCode::DATA_LOSS: return ErrorCode::kDataLoss;
        default: return ErrorCode::kInternal;  // RESOURCE_EXHAUSTED too: the server names its own
    }
}

/// What gRPC and OpenSSL say when there is no connection, and what a user needs to hear. `{}` is the address.
struct Translation {
    const char* details;
    const char* plain;
};

constexpr Translation kTranslations[] = {
    {"DNS resolution failed", "cannot reach a server at {}: its host name cannot be resolved"},
    {"C-ares", "cannot reach a server at {}: its host name cannot be resolved"},
    {"wrong version number",
     "what answers at {} does not speak TLS: connect without it (no --tls, --tls-ca or SHAPEDB_TLS), or "
     "switch it on at the server; or it is the port of the web page"},
    {"certificate verify failed",
     "the certificate of the server at {} cannot be trusted: it has expired, or another authority signed it "
     "than those that are trusted here; give the file of the right one with --tls-ca, or renew the "
     "certificate"},
    {"is not in peer certificate",
     "the certificate of the server at {} is for another name: connect by a name that it has, or give that "
     "name with --server-name"},
    {"empty address list",
     "the files for TLS cannot be used for {}: one is not PEM, or the certificate and the key do not belong "
     "together (--tls-ca, --client-certificate, --client-key)"},
    {"Failed parsing HTTP/2",
     "what answers at {} is not a ShapeDB server: is it the right port? (that of the web page is another)"},
    {"http1.x",
     "what answers at {} is not a ShapeDB server: is it the right port? (that of the web page is another)"},
    {"Connection refused", "cannot reach a server at {}: nothing is listening there; is shapedbd running?"},
    {"No such file or directory",
     "cannot reach a server at {}: there is no such socket; is shapedbd running, and does it listen there?"},
    {"Permission denied", "cannot reach a server at {}: you may not use that socket"},
    {"No route to host", "cannot reach a server at {}: there is no route to it from this machine"},
    {"Network is unreachable", "cannot reach a server at {}: there is no route to it from this machine"},
    {"timed out", "cannot reach a server at {}: nothing answers there; is a firewall between?"},
};

/// What becomes of a call when the server closes the connection at once.
constexpr const char* kClosed[] = {"Socket closed", "Connection reset by peer", "Endpoint read failed",
                                   "Broken pipe"};
constexpr const char* kClosedPlain =
    "the server at {} closed the connection: it probably wants TLS (--tls, with --tls-ca the file of its "
    "authority), or is being stopped";
constexpr const char* kClosedTls =
    "the server at {} closed the connection: it may ask for a certificate of yours (--client-certificate, "
    "--client-key), or is being stopped";

std::string about(const std::string& address, std::string text) {
    return text.replace(text.find("{}"), 2, address);
}

/// Why there is no connection, in words of a user rather than of gRPC.
std::string unreachable(const Peer& peer, const std::string& details) {
    const auto says = [&](const char* words) { return details.find(words) != std::string::npos; };
    for (const Translation& one : kTranslations) {
        if (says(one.details)) return about(peer.address, one.plain);
    }
    for (const char* closed : kClosed) {
        if (says(closed)) return about(peer.address, peer.tls ? kClosedTls : kClosedPlain);
    }
    return "cannot reach a server at " + peer.name() + ": is shapedbd running there? (" + details + ")";
}

}  // namespace

Error errorOf(const grpc::Status& status, const TrailingMetadata& trailing, const Peer& peer) {
    if (const auto name = valueOf(trailing, "shapedb-error")) {
        return {errorCodeFromName(*name), status.error_message()};
    }
    const Error error{codeOf(status.error_code()), status.error_message()};
    if (error.message.rfind(kCutOffPrefix, 0) == 0) return error;
    switch (status.error_code()) {
        case grpc::StatusCode::UNAVAILABLE: return {error.code, unreachable(peer, error.message)};
        case grpc::StatusCode::DEADLINE_EXCEEDED:
            return {error.code, "the server at " + peer.name() + " did not answer before the deadline"};
        case grpc::StatusCode::UNIMPLEMENTED:
            return {error.code, "what answers at " + peer.name() +
                                    " does not know this call: it is not a ShapeDB server, or an older one" +
                                    (error.message.empty() ? "" : " (" + error.message + ")")};
        default: return error;
    }
}

AttemptFailure failureOf(const grpc::Status& status, const TrailingMetadata& trailing, const Error& error) {
    AttemptFailure failure;
    failure.code = error.code;
    failure.pushback = valueOf(trailing, "grpc-retry-pushback-ms");
    if (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED && failure.pushback) {
        failure.code = ErrorCode::kQueueFull;
    }
    // It would not know the call next time either.
    if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) failure.code = ErrorCode::kRejected;
    return failure;
}

}  // namespace shapedb::client
