// SPDX-License-Identifier: GPL-3.0-or-later
// How the points of a shape are stored. Persisted: docs/storage.md describes the bytes and a test
// pins them; a change needs a new format byte beside the old ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb::store {

/// First byte of the blob. Persisted: never renumber.
enum class PointFormat : std::uint8_t {
    kRaw = 0,         ///< little-endian float32 as they came; when compression does not pay
    kPlanesZstd = 1,  ///< one zstd frame of the points' bytes, regrouped into planes
};

/// Encodes packed x y z (a multiple of three numbers). Keeps every bit, NaN payloads included.
/// `level`: zstd level, 1 to 19. Errors: kOutOfMemory, kInternal (zstd failed).
[[nodiscard]] Result<std::string> encodePoints(const std::vector<float>& points, int level);

/// The blob that encodePoints makes, compressed once and kept until it is written. A large scan is
/// compressed in pieces: besides the points only their compressed form is in memory, and nothing
/// when it would not be smaller.
class PointEncoding {
  public:
    /// Takes the next bytes of the blob. May throw Failure.
    using Sink = std::function<void(const void* data, std::size_t size)>;

    /// `points` is not owned and must outlive this. Errors: as encodePoints.
    [[nodiscard]] static Result<PointEncoding> encode(const std::vector<float>& points, int level);

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    /// The whole blob of a small scan; null when it has to be written in pieces.
    [[nodiscard]] const std::string* whole() const noexcept { return isWhole_ ? &blob_ : nullptr; }
    /// Calls `sink` with pieces that add up to `size()` bytes. Throws what it throws.
    void write(const Sink& sink) const;

    /// Scans of up to this many bytes are stored as one blob.
    static constexpr std::size_t kWholeBytes = std::size_t{8} << 20;

  private:
    PointEncoding() = default;

    const std::vector<float>* points_ = nullptr;
    std::uint64_t size_ = 0;
    bool isWhole_ = false;
    std::string blob_;
    /// Of a large scan: the zstd frame in pieces; empty when the points are stored as they are.
    std::vector<std::string> frame_;
};

/// The inverse. `floatCount` is what the shape's row says; allocates only after the blob's own size
/// has agreed. Errors: kDataLoss (damaged, or another count), kSchemaTooNew
/// (format byte unknown), kOutOfMemory.
[[nodiscard]] Result<std::vector<float>> decodePoints(const void* blob, std::size_t size,
                                                      std::uint64_t floatCount);

/// The regrouping alone, exposed for tests: byte k (0 to 11) of point i moves from 12 i + k to k * pointCount
/// + i, so that each byte of x, y and z forms a plane. `in` and `out` hold 12 * pointCount bytes and do not
/// overlap.
void bytesToPlanes(const unsigned char* in, unsigned char* out, std::size_t pointCount);
void planesToBytes(const unsigned char* in, unsigned char* out, std::size_t pointCount);

}  // namespace shapedb::store
