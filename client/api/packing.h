// Scans as they are sent: packed little-endian float32.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/point_stream.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb::client {

/// Bytes of one chunk: the most whole points that fit.
constexpr std::size_t kChunkBytes = kMaxChunkBytes / kPointBytes * kPointBytes;

/// A float32 rounds a coordinate beyond this many box diagonals by more than 2^-20 (a millionth) of the
/// diagonal: it has 24 significant bits, and 24 = 20 + log2(16).
constexpr double kFarFromOrigin = 16.0;

struct PackedPoints {
    std::string bytes;  ///< kPointBytes * count
    std::uint64_t count = 0;
    std::string sha256;  ///< 32 bytes, of `bytes`
    Point3 offset;       ///< subtracted from every point, scan units
};

/// Errors: kTooFewPoints (none); kNonFiniteCoordinate; kCoordinateOutOfRange (beyond the largest float32, or
/// the whole scan too small for one). The message names the first such point.
[[nodiscard]] Result<PackedPoints> packPoints(const PointCloud& points);

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

/// Appends to `points`. Errors: kMalformedStream (not a multiple of kPointBytes).
[[nodiscard]] Result<void> unpackPoints(const std::string& bytes, PointCloud& points);

/// "12 0.5 -3", with enough digits to read the same doubles back.
[[nodiscard]] std::string offsetText(const Point3& offset);
/// The inverse. Errors: kDataLoss (other text).
[[nodiscard]] Result<Point3> offsetOf(const std::string& text);

}  // namespace shapedb::client
