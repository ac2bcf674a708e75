// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/failure.h"

#include <nlohmann/json.hpp>

#include "common/api_key_text.h"
#include "server/rpc/status.h"
#include "shapedb/v1/types.pb.h"

namespace shapedb::http {
namespace {

using Json = nlohmann::ordered_json;  // code and message first: people read it

/// As the protocol wants binary values: base64 without padding.
std::string base64(const std::string& bytes) {
    constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    unsigned held = 0;
    int bits = 0;
    for (const char c : bytes) {
        held = (held << 8 | static_cast<unsigned char>(c)) & 0xffff;
        for (bits += 8; bits >= 6; bits -= 6) text += kDigits[held >> (bits - 6) & 63];
    }
    if (bits > 0) text += kDigits[held << (6 - bits) & 63];
    return text;
}

/// Texts come from gRPC and from clients: what is not UTF-8 is replaced.
std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json jsonOf(const Failure& failure) {
    Json json = {{"code", codeName(failure.code)}, {"message", maskSecrets(failure.message)}};
    if (failure.name.empty()) return json;
    v1::ErrorDetail detail;
    detail.set_name(failure.name);
    Json readable = {{"name", failure.name}};
    if (failure.retryAfter) {
        const auto ms = failure.retryAfter->count();
        detail.set_retry_after_ms(static_cast<std::uint64_t>(ms));
        readable["retryAfterMs"] = std::to_string(ms);  // JSON of protobuf has 64 bits as text
    }
    json["details"] = Json::array({{{"type", detail.GetTypeName()},
                                    {"value", base64(detail.SerializeAsString())},
                                    {"debug", readable}}});
    return json;
}

}  // namespace

// No default label in either: a new code must be added here before it compiles.
const char* codeName(Code code) noexcept {
    switch (code) {
        case Code::kCanceled: return "canceled";
        case Code::kUnknown: return "unknown";
        case Code::kInvalidArgument: return "invalid_argument";
        case Code::kDeadlineExceeded: return "deadline_exceeded";
        case Code::kNotFound: return "not_found";
        case Code::kAlreadyExists: return "already_exists";
        case Code::kPermissionDenied: return "permission_denied";
        case Code::kResourceExhausted: return "resource_exhausted";
        case Code::kFailedPrecondition: return "failed_precondition";
        case Code::kAborted: return "aborted";
        case Code::kOutOfRange: return "out_of_range";
        case Code::kUnimplemented: return "unimplemented";
        case Code::kInternal: return "internal";
        case Code::kUnavailable: return "unavailable";
        case Code::kDataLoss: return "data_loss";
        case Code::kUnauthenticated: return "unauthenticated";
    }
    return "unknown";
}

unsigned httpStatusOf(Code code) noexcept {
    switch (code) {
        case Code::kCanceled: return 499;
        case Code::kInvalidArgument:
        case Code::kFailedPrecondition:
        case Code::kOutOfRange: return 400;
        case Code::kUnauthenticated: return 401;
        case Code::kPermissionDenied: return 403;
        case Code::kNotFound: return 404;
        case Code::kAlreadyExists:
        case Code::kAborted: return 409;
        case Code::kResourceExhausted: return 429;
        case Code::kUnimplemented: return 501;
        case Code::kUnavailable: return 503;
        case Code::kDeadlineExceeded: return 504;
        case Code::kUnknown:
        case Code::kInternal:
        case Code::kDataLoss: return 500;
    }
    return 500;
}

Code codeOfNumber(int grpcCode) noexcept {
    const bool known =
        grpcCode >= static_cast<int>(Code::kCanceled) && grpcCode <= static_cast<int>(Code::kUnauthenticated);
    return known ? static_cast<Code>(grpcCode) : Code::kUnknown;
}

tl::unexpected<Failure> refuse(ErrorCode code, std::string message) {
    Failure failure;
    failure.code = codeOfNumber(rpc::statusCodeOf(code));
    failure.message = std::move(message);
    failure.name = errorCodeName(code);
    return tl::unexpected<Failure>(std::move(failure));
}

tl::unexpected<Failure> refuseWith(unsigned status, Code code, std::string message) {
    Failure failure;
    failure.code = code;
    failure.message = std::move(message);
    failure.status = status;
    return tl::unexpected<Failure>(std::move(failure));
}

std::string failureJson(const Failure& failure) { return dump(jsonOf(failure)); }

std::string endOfStreamJson(const Failure* failure, const Trailers& trailers) {
    Json json = Json::object();
    if (failure != nullptr) json["error"] = jsonOf(*failure);
    for (const auto& [key, value] : trailers) json["metadata"][key].push_back(value);
    return dump(json);
}

}  // namespace shapedb::http
