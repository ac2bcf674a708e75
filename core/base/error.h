// SPDX-License-Identifier: Apache-2.0
// Errors as values: the one closed enum of everything that can go wrong, and the
// Result type every fallible function returns.
//
// No exception crosses a module. Failures of CGAL, SQLite, gRPC or the allocator are
// translated to an Error where the library is called.
#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace shapedb {

/// Every way a call can fail. The set is closed: adding a value makes each exhaustive
/// switch (gRPC codes, exit codes, names) fail to compile until it is handled.
/// The numeric values are not stored anywhere; the names (`errorCodeName`) are.
enum class ErrorCode {
    // The scan itself is unusable.
    kNonFiniteCoordinate,   ///< a coordinate is NaN or infinite
    kCoordinateOutOfRange,  ///< a magnitude or the whole extent exceeds single precision
    kTooFewPoints,          ///< fewer than four distinct points
    kAllPointsEqual,        ///< every point is the same point
    kCollinear,             ///< all points lie on one line
    kCoplanar,              ///< all points lie in one plane
    kNoInterior,            ///< no closed interior: every big Delaunay ball is reached from outside
    kPointLimitExceeded,    ///< more points than the configured limit
    // A file cannot be read or written.
    kFileNotReadable,    ///< missing, a folder, or no permission
    kUnknownFileFormat,  ///< the extension is of no format we read
    kMalformedFile,      ///< header or body break the format, or the file is truncated
    kFileNotWritable,    ///< output cannot be created or written in full
    // The request is wrong.
    kInvalidArgument,     ///< a parameter is outside its documented range
    kMalformedFilter,     ///< a metadata filter does not parse
    kMalformedCursor,     ///< a page cursor is damaged or belongs to another listing
    kMalformedSignature,  ///< signature bytes are damaged or of an unknown version
    kMalformedStream,     ///< the messages of a stream come in an invalid order
    kChecksumMismatch,    ///< the points received do not have the announced checksum
    kCountMismatch,       ///< the number of points received is not the announced one
    // The request is fine, the state does not allow it.
    kNotFound,         ///< no such collection, shape, key or job
    kAlreadyExists,    ///< insert-only and the key is taken, or the collection exists
    kVersionConflict,  ///< the expected version is not the current one
    kNotReady,         ///< the shape exists but has no signature (yet)
    kRejected,         ///< the operation makes no sense in this state; the message says which
    // The caller is not allowed to do it.
    kUnauthenticated,   ///< no API key, or one that is unknown, revoked or has expired
    kPermissionDenied,  ///< the API key does not allow this
    // The system cannot do it now.
    kQueueFull,         ///< the ingest queue is at its bound; retry later
    kRateLimited,       ///< the API key has used up what it may use for now; retry later
    kUnavailable,       ///< shutting down, not started, or not reachable
    kCancelled,         ///< the caller asked to stop
    kDeadlineExceeded,  ///< the caller's deadline passed
    kOutOfMemory,       ///< an allocation failed
    kStorage,           ///< the database could not be read or written
    kStorageFull,       ///< no room left on the device
    kDataLoss,          ///< stored bytes are damaged
    kSchemaTooNew,      ///< the database was written by a newer version
    kInternal,          ///< a broken invariant: always a bug of ours
};

/// Stable snake_case name without the `k`, e.g. "non_finite_coordinate". Used in JSON
/// output, in logs and in the database.
const char* errorCodeName(ErrorCode code) noexcept;

/// The inverse of `errorCodeName`; kInternal for an unknown name (written by a newer version).
ErrorCode errorCodeFromName(const std::string& name) noexcept;

/// The message tells the person who has to act on it what was wrong, where, and what to do. No trailing full
/// stop, no newline.
struct Error {
    ErrorCode code = ErrorCode::kInternal;
    std::string message;
};

template <typename T>
using Result = tl::expected<T, Error>;

/// The same error, saying first what it is about: "query 3: " or the path of a file.
[[nodiscard]] inline Error withContext(Error error, const std::string& prefix) {
    error.message.insert(0, prefix);
    return error;
}

/// `return fail(ErrorCode::kNotFound, "...");` from any function returning a Result.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
    return tl::unexpected<Error>(Error{code, std::move(message)});
}

/// Forwards the error of another Result: `if (!r) return fail(r.error());` (see RETURN_IF_ERROR).
inline tl::unexpected<Error> fail(Error error) { return tl::unexpected<Error>(std::move(error)); }

}  // namespace shapedb
