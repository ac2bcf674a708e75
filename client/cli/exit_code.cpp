// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/exit_code.h"

namespace shapedb::cli {

ExitCode exitCodeOf(ErrorCode code) noexcept {
    switch (code) {
        case ErrorCode::kInvalidArgument:
        case ErrorCode::kMalformedFilter:
        case ErrorCode::kMalformedCursor: return kUsage;

        case ErrorCode::kNonFiniteCoordinate:
        case ErrorCode::kCoordinateOutOfRange:
        case ErrorCode::kTooFewPoints:
        case ErrorCode::kAllPointsEqual:
        case ErrorCode::kCollinear:
        case ErrorCode::kCoplanar:
        case ErrorCode::kNoInterior:
        case ErrorCode::kPointLimitExceeded:
        case ErrorCode::kFileNotReadable:
        case ErrorCode::kUnknownFileFormat:
        case ErrorCode::kMalformedFile:
        case ErrorCode::kFileNotWritable:
        case ErrorCode::kMalformedSignature:
        case ErrorCode::kMalformedStream:
        case ErrorCode::kChecksumMismatch:
        case ErrorCode::kCountMismatch: return kBadData;

        case ErrorCode::kNotFound:
        case ErrorCode::kAlreadyExists:
        case ErrorCode::kVersionConflict:
        case ErrorCode::kNotReady:
        case ErrorCode::kRejected:
        case ErrorCode::kUnauthenticated:
        case ErrorCode::kPermissionDenied: return kWrongState;

        case ErrorCode::kQueueFull:
        case ErrorCode::kRateLimited:
        case ErrorCode::kUnavailable:
        case ErrorCode::kDeadlineExceeded: return kUnavailable;

        case ErrorCode::kCancelled: return kInterrupted;

        case ErrorCode::kOutOfMemory:
        case ErrorCode::kStorage:
        case ErrorCode::kStorageFull:
        case ErrorCode::kDataLoss:
        case ErrorCode::kSchemaTooNew:
        case ErrorCode::kInternal: return kDefect;
    }
    return kDefect;
}

}  // namespace shapedb::cli
