// How the points of a shape are kept in the database. Persisted: docs/storage.md describes
// the bytes, a test holds them; a change needs a new format byte beside the old ones.
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
    kRaw = 0,         ///< little-endian float32 as they came; used when the other is not smaller
    kPlanesZstd = 1,  ///< one zstd frame of the points' bytes, regrouped into planes
};

/// Encodes packed x y z (a multiple of three numbers). Bits are kept exactly, NaN payloads included. `level`:
/// zstd level, 1 to 19. Errors: kOutOfMemory, kInternal (zstd failed).
[[nodiscard]] Result<std::string> encodePoints(const std::vector<float>& points, int level);

/// What encodePoints makes, for scans too large to be in memory a second time: the blob of a large scan
/// is made twice instead of held, once for its size and once piece by piece. A small one is held.
class PointEncoding {
  public:
    /// Takes the next bytes of the blob. May throw Failure.
    using Sink = std::function<void(const void* data, std::size_t size)>;

    /// `points` is not owned and must outlive this. Takes about 2 MB with level 1 (more with higher ones:
    /// zstd's tables). Errors: as encodePoints.
    [[nodiscard]] static Result<PointEncoding> plan(const std::vector<float>& points, int level);

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    /// All of it; null when it is not held and has to be written in pieces.
    [[nodiscard]] const std::string* held() const noexcept { return held_ ? &blob_ : nullptr; }
    /// Calls `sink` with exactly `size()` bytes in pieces. Throws what it throws, and Failure:
    /// kOutOfMemory, kInternal.
    void write(const Sink& sink) const;

    /// Scans up to so many bytes of points are held.
    static constexpr std::size_t kHeldBytes = std::size_t{8} << 20;

  private:
    PointEncoding() = default;
    std::uint64_t compress(const Sink& sink) const;

    const std::vector<float>* points_ = nullptr;
    int level_ = 1;
    PointFormat format_ = PointFormat::kRaw;
    std::uint64_t size_ = 0;
    bool held_ = false;
    std::string blob_;
};

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
