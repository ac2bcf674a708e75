// SPDX-License-Identifier: Apache-2.0
#include "client/api/status.h"

#include "common/cut_off.h"

namespace shapedb::client {

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

/// Why there is no connection, in words of a user rather than of gRPC.
std::string unreachable(const std::string& address, const std::string& details) {
    const auto says = [&](const char* words) { return details.find(words) != std::string::npos; };
    if (says("DNS resolution failed") || says("C-ares")) {
        return "cannot reach a server at " + address + ": this machine knows no host of that name";
    }
    if (says("Failed parsing HTTP/2") || says("http1.x")) {
        return "what answers at " + address +
               " is not a ShapeDB server: is it the right port? (that of the web page is another)";
    }
    if (says("Connection refused")) {
        return "cannot reach a server at " + address + ": nobody listens there; is shapedbd running?";
    }
    // What becomes of a call without TLS to a server that wants it.
    const bool closed = says("Socket closed");
    return "cannot reach a server at " + address + ": is shapedbd running there" +
           (closed ? ", and does it want TLS" : "") + "? (" + details + ")";
}

}  // namespace

Error errorOf(const grpc::Status& status, const TrailingMetadata& trailing, const std::string& address) {
    if (const auto name = valueOf(trailing, "shapedb-error")) {
        return {errorCodeFromName(*name), status.error_message()};
    }
    const Error error{codeOf(status.error_code()), status.error_message()};
    if (error.message.rfind(kCutOffPrefix, 0) == 0) return error;
    switch (status.error_code()) {
        case grpc::StatusCode::UNAVAILABLE: return {error.code, unreachable(address, error.message)};
        case grpc::StatusCode::DEADLINE_EXCEEDED:
            return {error.code, "the server at " + address + " did not answer before the deadline"};
        case grpc::StatusCode::UNIMPLEMENTED:
            return {error.code, "what answers at " + address +
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
