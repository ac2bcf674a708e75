// SPDX-License-Identifier: Apache-2.0
// Scans as they are sent: packed little-endian float32.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/protocol.h"
#include "common/wire_vector.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb::client {

/// Bytes of one chunk: the most whole points that fit.
constexpr std::size_t kChunkBytes = kMaxChunkBytes / kPointBytes * kPointBytes;

struct PackedPoints {
    std::string bytes;  ///< kPointBytes * count
    std::uint64_t count = 0;
    std::string sha256;  ///< 32 bytes, of `bytes`
    Point3 origin;       ///< subtracted from every point, scan units; zero unless they lie far from it
};

/// The origin is the middle of the box around the main part of the points, so without outliers, if that lies
/// far from 0, 0, 0 (isFarFromOrigin) or single precision cannot hold it there.
///
/// Errors: kTooFewPoints (none); kNonFiniteCoordinate; kCoordinateOutOfRange (beyond the largest float32, the
/// whole scan too small for one, an outlier too far from the others, or rounded before: checkNotRounded). The
/// message names the first such point.
[[nodiscard]] Result<PackedPoints> packPoints(const PointCloud& points);

/// The fields of a header that describe its points.
template <typename Header>
void fill(const PackedPoints& points, Header* header) {
    header->set_point_count(points.count);
    header->set_sha256(points.sha256);
    if (points.origin != Point3{}) wire::toProto(points.origin, header->mutable_origin());
}

/// Writes the points in chunks. False, early, if the server has already answered. `Request` has a chunk.
template <typename Request, typename Stream>
bool writeChunks(Stream& stream, const PackedPoints& points, const RunContext& context) {
    for (std::size_t at = 0; at < points.bytes.size(); at += kChunkBytes) {
        const std::size_t size = std::min(kChunkBytes, points.bytes.size() - at);
        Request message;
        message.mutable_chunk()->set_xyz(points.bytes.data() + at, size);
        if (!stream.Write(message)) return false;
        context.report("upload", at + size, points.bytes.size());
    }
    return true;
}

/// Writes `header`, then the points in chunks. Stops early if the server has already answered; the status of
/// the call then says why. `Request` has the oneof {header, chunk}.
template <typename Request, typename Stream>
void writeScan(Stream& stream, const Request& header, const PackedPoints& points, const RunContext& context) {
    if (stream.Write(header) && writeChunks<Request>(stream, points, context)) stream.WritesDone();
}

/// Appends to `points` what `bytes` has relative to `origin`, with the bits of single precision if that is
/// zero. Errors: kMalformedStream (not a multiple of kPointBytes).
[[nodiscard]] Result<void> unpackPoints(const std::string& bytes, const Point3& origin, PointCloud& points);

}  // namespace shapedb::client
