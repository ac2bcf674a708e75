// How the points of a shape are kept in the database. Persisted: docs/storage.md describes
// the bytes, a test holds them; a change needs a new format byte beside the old ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb::store {

/// First byte of the blob. Persisted: never renumber.
enum class PointFormat : std::uint8_t {
    kRaw = 0,         ///< little-endian float32 as they came; used when the other is not smaller
    kPlanesZstd = 1,  ///< one zstd frame of the points' bytes, regrouped into planes
};

/// Encodes packed x y z (a multiple of three numbers). Bits are kept exactly, NaN payloads included. `level`:
/// zstd level, 1 to 19. Errors: kOutOfMemory, kInternal (zstd failed).
[[nodiscard]] Result<std::string> encodePoints(const std::vector<float>& points, int level);

/// The inverse. `floatCount` is what the shape's row says; nothing is allocated before the
/// blob's own size agrees. Errors: kDataLoss (damaged, or another count), kSchemaTooNew
/// (format byte unknown), kOutOfMemory.
[[nodiscard]] Result<std::vector<float>> decodePoints(const void* blob, std::size_t size,
                                                      std::uint64_t floatCount);

/// The regrouping alone, for the tests: byte k (0 to 11) of point i moves from 12 i + k to
/// k * pointCount + i, so that each byte of x, of y and of z forms a plane. Neighbouring scan
/// points share sign, exponent and leading digits of each coordinate, so whole planes nearly
/// repeat. `in` and `out` hold 12 * pointCount bytes and do not overlap.
void bytesToPlanes(const unsigned char* in, unsigned char* out, std::size_t pointCount);
void planesToBytes(const unsigned char* in, unsigned char* out, std::size_t pointCount);

}  // namespace shapedb::store
