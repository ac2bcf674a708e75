// SPDX-License-Identifier: Apache-2.0
#include "core/base/error.h"

namespace shapedb {

namespace {

constexpr int kCodeCount = static_cast<int>(ErrorCode::kInternal) + 1;

}  // namespace

const char* errorCodeName(ErrorCode code) noexcept {
    switch (code) {
        case ErrorCode::kNonFiniteCoordinate: return "non_finite_coordinate";
        case ErrorCode::kCoordinateOutOfRange: return "coordinate_out_of_range";
        case ErrorCode::kTooFewPoints: return "too_few_points";
        case ErrorCode::kAllPointsEqual: return "all_points_equal";
        case ErrorCode::kCollinear: return "collinear";
        case ErrorCode::kCoplanar: return "coplanar";
        case ErrorCode::kNoInterior: return "no_interior";
        case ErrorCode::kPointLimitExceeded: return "point_limit_exceeded";
        case ErrorCode::kFileNotReadable: return "file_not_readable";
        case ErrorCode::kUnknownFileFormat: return "unknown_file_format";
        case ErrorCode::kMalformedFile: return "malformed_file";
        case ErrorCode::kFileNotWritable: return "file_not_writable";
        case ErrorCode::kInvalidArgument: return "invalid_argument";
        case ErrorCode::kMalformedFilter: return "malformed_filter";
        case ErrorCode::kMalformedCursor: return "malformed_cursor";
        case ErrorCode::kMalformedSignature: return "malformed_signature";
        case ErrorCode::kMalformedStream: return "malformed_stream";
        case ErrorCode::kChecksumMismatch: return "checksum_mismatch";
        case ErrorCode::kCountMismatch: return "count_mismatch";
        case ErrorCode::kNotFound: return "not_found";
        case ErrorCode::kAlreadyExists: return "already_exists";
        case ErrorCode::kVersionConflict: return "version_conflict";
        case ErrorCode::kNotReady: return "not_ready";
        case ErrorCode::kRejected: return "rejected";
        case ErrorCode::kUnauthenticated: return "unauthenticated";
        case ErrorCode::kPermissionDenied: return "permission_denied";
        case ErrorCode::kQueueFull: return "queue_full";
        case ErrorCode::kRateLimited: return "rate_limited";
        case ErrorCode::kUnavailable: return "unavailable";
        case ErrorCode::kCancelled: return "cancelled";
        case ErrorCode::kDeadlineExceeded: return "deadline_exceeded";
        case ErrorCode::kOutOfMemory: return "out_of_memory";
        case ErrorCode::kStorage: return "storage";
        case ErrorCode::kStorageFull: return "storage_full";
        case ErrorCode::kDataLoss: return "data_loss";
        case ErrorCode::kSchemaTooNew: return "schema_too_new";
        case ErrorCode::kInternal: return "internal";
    }
    return "internal";
}

ErrorCode errorCodeFromName(const std::string& name) noexcept {
    for (int i = 0; i < kCodeCount; ++i) {
        const auto code = static_cast<ErrorCode>(i);
        if (name == errorCodeName(code)) return code;
    }
    return ErrorCode::kInternal;
}

}  // namespace shapedb
