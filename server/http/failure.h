// SPDX-License-Identifier: GPL-3.0-or-later
// Failures as HTTP clients see them: those of calls by the Connect protocol's rules, and those of HTTP
// itself.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/base/error.h"

namespace shapedb::http {

/// The Connect protocol's codes, with the numbers that gRPC gives them.
enum class Code {
    kCanceled = 1,
    kUnknown = 2,
    kInvalidArgument = 3,
    kDeadlineExceeded = 4,
    kNotFound = 5,
    kAlreadyExists = 6,
    kPermissionDenied = 7,
    kResourceExhausted = 8,
    kFailedPrecondition = 9,
    kAborted = 10,
    kOutOfRange = 11,
    kUnimplemented = 12,
    kInternal = 13,
    kUnavailable = 14,
    kDataLoss = 15,
    kUnauthenticated = 16,
};

/// "canceled" and so on.
[[nodiscard]] const char* codeName(Code code) noexcept;
/// The HTTP status that the protocol gives a failed unary call.
[[nodiscard]] unsigned httpStatusOf(Code code) noexcept;
/// Numbers that gRPC does not have are kUnknown.
[[nodiscard]] Code codeOfNumber(int grpcCode) noexcept;

/// Metadata that follow an answer, in lower case.
using Trailers = std::multimap<std::string, std::string>;

struct Failure {
    Code code = Code::kUnknown;
    std::string message;
    std::string name{};                                     ///< the stable name of ours; may be empty
    std::optional<std::chrono::milliseconds> retryAfter{};  ///< when to try again
    unsigned status = 0;                                    ///< of HTTP; 0: httpStatusOf(code)

    [[nodiscard]] unsigned httpStatus() const { return status != 0 ? status : httpStatusOf(code); }
};

/// An error of ours, found before any handler was called.
[[nodiscard]] tl::unexpected<Failure> refuse(ErrorCode code, std::string message);
/// What HTTP itself refuses, with a status of its own.
[[nodiscard]] tl::unexpected<Failure> refuseWith(unsigned status, Code code, std::string message);

/// A value, or why there is none.
template <typename T>
using OrFailure = tl::expected<T, Failure>;

/// {"code": ..., "message": ..., "details": [...]}: the body of a unary answer.
[[nodiscard]] std::string failureJson(const Failure& failure);
/// The last message of a stream of answers; `failure` null: success.
[[nodiscard]] std::string endOfStreamJson(const Failure* failure, const Trailers& trailers);

}  // namespace shapedb::http

namespace shapedb {

/// For RETURN_IF_ERROR.
inline tl::unexpected<http::Failure> fail(http::Failure failure) {
    return tl::unexpected<http::Failure>(std::move(failure));
}

}  // namespace shapedb
