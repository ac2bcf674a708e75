// SPDX-License-Identifier: GPL-3.0-or-later
// Errors as gRPC clients see them.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "core/base/error.h"

namespace shapedb::rpc {

/// Trailing metadata of every failed call: the stable name of the error.
constexpr const char* kErrorNameKey = "shapedb-error";
/// Trailing metadata of RESOURCE_EXHAUSTED: milliseconds after which to try again.
constexpr const char* kRetryKey = "grpc-retry-pushback-ms";

/// The mapping of errors to gRPC codes (a table in docs/api.md).
[[nodiscard]] grpc::StatusCode statusCodeOf(ErrorCode code) noexcept;

/// The name of the error of a call that was cut off, of which gRPC sends nothing but code and message.
[[nodiscard]] const char* nameOfCutOff(grpc::StatusCode code) noexcept;

/// The status of a failed call; adds the trailing metadata, masks secrets in the message and cuts
/// it to kMaxErrorMessageBytes.
[[nodiscard]] grpc::Status makeStatus(const Error& error, grpc::ServerContext& context,
                                      std::optional<std::chrono::milliseconds> retryAfter = std::nullopt);

}  // namespace shapedb::rpc
