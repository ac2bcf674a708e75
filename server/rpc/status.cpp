// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/status.h"

#include "common/api_key_text.h"
#include "common/safe_text.h"
#include "server/rpc/limit_table.h"

namespace shapedb::rpc {

// No default label: a new ErrorCode must be added here before it compiles.
grpc::StatusCode statusCodeOf(ErrorCode code) noexcept {
    switch (code) {
        case ErrorCode::kNonFiniteCoordinate:
        case ErrorCode::kCoordinateOutOfRange:
        case ErrorCode::kTooFewPoints:
        case ErrorCode::kAllPointsEqual:
        case ErrorCode::kCollinear:
        case ErrorCode::kCoplanar:
        case ErrorCode::kNoInterior:
        case ErrorCode::kUnknownFileFormat:
        case ErrorCode::kMalformedFile:
        case ErrorCode::kInvalidArgument:
        case ErrorCode::kMalformedFilter:
        case ErrorCode::kMalformedCursor:
        case ErrorCode::kMalformedSignature:
        case ErrorCode::kMalformedStream:
        case ErrorCode::kChecksumMismatch:
        case ErrorCode::kCountMismatch: return grpc::StatusCode::INVALID_ARGUMENT;
        case ErrorCode::kPointLimitExceeded: return grpc::StatusCode::OUT_OF_RANGE;
        case ErrorCode::kNotFound: return grpc::StatusCode::NOT_FOUND;
        case ErrorCode::kAlreadyExists: return grpc::StatusCode::ALREADY_EXISTS;
        case ErrorCode::kVersionConflict: return grpc::StatusCode::ABORTED;
        case ErrorCode::kNotReady:
        case ErrorCode::kRejected:
        case ErrorCode::kSchemaTooNew: return grpc::StatusCode::FAILED_PRECONDITION;
        case ErrorCode::kUnauthenticated: return grpc::StatusCode::UNAUTHENTICATED;
        case ErrorCode::kPermissionDenied: return grpc::StatusCode::PERMISSION_DENIED;
        case ErrorCode::kQueueFull:
        case ErrorCode::kRateLimited:
        case ErrorCode::kOutOfMemory:
        case ErrorCode::kStorageFull: return grpc::StatusCode::RESOURCE_EXHAUSTED;
        case ErrorCode::kUnavailable: return grpc::StatusCode::UNAVAILABLE;
        case ErrorCode::kCancelled: return grpc::StatusCode::CANCELLED;
        case ErrorCode::kDeadlineExceeded: return grpc::StatusCode::DEADLINE_EXCEEDED;
        case ErrorCode::kDataLoss: return grpc::StatusCode::DATA_LOSS;
        case ErrorCode::kFileNotReadable:
        case ErrorCode::kFileNotWritable:
        case ErrorCode::kStorage:
        case ErrorCode::kInternal: return grpc::StatusCode::INTERNAL;
    }
    return grpc::StatusCode::INTERNAL;
}

const char* nameOfCutOff(grpc::StatusCode code) noexcept {
    switch (code) {
        case grpc::StatusCode::DEADLINE_EXCEEDED: return errorCodeName(ErrorCode::kDeadlineExceeded);
        case grpc::StatusCode::UNAVAILABLE: return errorCodeName(ErrorCode::kUnavailable);
        case grpc::StatusCode::UNAUTHENTICATED: return errorCodeName(ErrorCode::kUnauthenticated);
        case grpc::StatusCode::PERMISSION_DENIED: return errorCodeName(ErrorCode::kPermissionDenied);
        default: return errorCodeName(ErrorCode::kCancelled);
    }
}

grpc::Status makeStatus(const Error& error, grpc::ServerContext& context,
                        std::optional<std::chrono::milliseconds> retryAfter) {
    context.AddTrailingMetadata(kErrorNameKey, errorCodeName(error.code));
    if (retryAfter) context.AddTrailingMetadata(kRetryKey, std::to_string(retryAfter->count()));
    return {statusCodeOf(error.code), cutText(maskSecrets(error.message), kMaxErrorMessageBytes)};
}

}  // namespace shapedb::rpc
