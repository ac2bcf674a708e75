// A scan that has passed every check: what the server stores and segments.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/sha256.h"
#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::store {

/// SHA-256 of the points as they travel: packed little-endian float32 x y z.
using Checksum = Sha256Digest;

/// Packed x y z as points. Throws std::bad_alloc.
[[nodiscard]] PointCloud toCloud(const std::vector<float>& xyz);

/// Packed points and their checksum. That the type exists says: the points are whole triples of
/// finite numbers, `checksum` is theirs, and they pass `sanitise`. Only ScanVerifier makes one, so
/// nothing behind it hashes or checks again.
class VerifiedScan {
  public:
    /// For points that are in memory already. Errors: as ScanVerifier; kInvalidArgument (not whole
    /// triples).
    [[nodiscard]] static Result<VerifiedScan> verify(std::vector<float> xyz);

    [[nodiscard]] const std::vector<float>& points() const noexcept { return xyz_; }
    [[nodiscard]] std::uint64_t pointCount() const noexcept { return xyz_.size() / 3; }
    [[nodiscard]] std::uint64_t bytes() const noexcept { return xyz_.size() * sizeof(float); }
    [[nodiscard]] const Checksum& checksum() const noexcept { return checksum_; }

  private:
    friend class ScanVerifier;
    VerifiedScan(std::vector<float> xyz, const Checksum& checksum)
        : xyz_(std::move(xyz)), checksum_(checksum) {}

    std::vector<float> xyz_;
    Checksum checksum_;
};

/// Checks a scan piece by piece while it arrives. Not thread-safe. After an error only destruction.
class ScanVerifier {
  public:
    /// How many points will come: memory grows no further than that. It is taken by what arrives, at most
    /// twice that much, not by what is announced.
    void expect(std::uint64_t points) { expected_ = points; }

    /// Whole points as bytes; `size` is a multiple of 12. Errors: kNonFiniteCoordinate, naming the
    /// index of the point from 0 and the axis. Throws std::bad_alloc.
    [[nodiscard]] Result<void> append(const void* bytes, std::size_t size);

    [[nodiscard]] std::uint64_t pointCount() const noexcept { return xyz_.size() / 3; }

    /// `expected` is the checksum the sender announced; null: none. Errors: kChecksumMismatch;
    /// kCoordinateOutOfRange (so far from the origin that single precision leaves fewer than a thousand steps
    /// across the scan); those of
    /// `sanitise`: the points could never be segmented. What only the segmentation can see (no interior)
    /// is found later.
    [[nodiscard]] Result<VerifiedScan> finish(const Checksum* expected = nullptr);

  private:
    friend class VerifiedScan;
    Result<void> take(std::size_t first);
    Result<void> checkUsable() const;
    Result<void> checkResolution() const;

    std::vector<float> xyz_;
    std::uint64_t expected_ = 0;  ///< points; 0: not known
    Sha256 hash_;
    std::array<std::size_t, 6> extremes_{};  ///< points with the lowest x, y, z; with the highest
};

}  // namespace shapedb::store
