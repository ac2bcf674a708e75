// Errors as a gRPC client sees them.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "core/base/error.h"

namespace shapedb::rpc {

/// Trailing metadata of every failing call: the stable name of the error.
constexpr const char* kErrorNameKey = "shapedb-error";
/// Trailing metadata of RESOURCE_EXHAUSTED: milliseconds after which to try again.
constexpr const char* kRetryKey = "grpc-retry-pushback-ms";

/// The one mapping of errors to gRPC codes (docs/api.md has it as a table).
[[nodiscard]] grpc::StatusCode statusCodeOf(ErrorCode code) noexcept;

/// The status of a failing call; adds the trailing metadata. The message is cut to
/// kMaxErrorMessageBytes at the border of a UTF-8 character.
[[nodiscard]] grpc::Status makeStatus(const Error& error, grpc::ServerContext& context,
                                      std::optional<std::chrono::milliseconds> retryAfter = std::nullopt);

/// At most `limit` bytes of `text`, never half a UTF-8 character.
[[nodiscard]] std::string cutText(const std::string& text, std::size_t limit);

}  // namespace shapedb::rpc
