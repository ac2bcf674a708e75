// SPDX-License-Identifier: GPL-3.0-or-later
// A scan that has passed every check: what the server stores and segments.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/sha256.h"
#include "core/base/error.h"
#include "core/geometry/box.h"
#include "core/geometry/main_part.h"
#include "core/geometry/point.h"

namespace shapedb::store {

/// SHA-256 of the points as they travel: packed little-endian float32 x y z.
using Checksum = Sha256Digest;

/// Packed x y z as points. Throws std::bad_alloc.
[[nodiscard]] PointCloud toCloud(const std::vector<float>& xyz);

/// Packed points, their checksum and what they are relative to. That the type exists says: the points are
/// whole triples of finite numbers, `checksum` is theirs, they pass `sanitise`, and with the origin they keep
/// their shape. Only ScanVerifier makes one, so nothing behind it hashes or checks again.
class VerifiedScan {
  public:
    /// For points that are in memory already. Errors: as ScanVerifier; kInvalidArgument (not whole
    /// triples).
    [[nodiscard]] static Result<VerifiedScan> verify(std::vector<float> xyz, const Point3& origin = {});

    [[nodiscard]] const std::vector<float>& points() const noexcept { return xyz_; }
    [[nodiscard]] std::uint64_t pointCount() const noexcept { return xyz_.size() / 3; }
    [[nodiscard]] std::uint64_t bytes() const noexcept { return xyz_.size() * sizeof(float); }
    /// The hash of the points alone. Two scans are the same if this and the origin are.
    [[nodiscard]] const Checksum& checksum() const noexcept { return checksum_; }
    /// Added to each point it gives the coordinates that the client has. Usually 0, 0, 0.
    [[nodiscard]] const Point3& origin() const noexcept { return origin_; }

  private:
    friend class ScanVerifier;
    VerifiedScan(std::vector<float> xyz, const Checksum& checksum, const Point3& origin)
        : xyz_(std::move(xyz)), checksum_(checksum), origin_(origin) {}

    std::vector<float> xyz_;
    Checksum checksum_;
    Point3 origin_;
};

/// Whether points in `box` may be relative to `origin`; both finite. Errors: kCoordinateOutOfRange (they are
/// beyond kMaxCoordinate with it, or double precision cannot hold the sums, as coarseInDoublePrecision).
[[nodiscard]] Result<void> checkPlacement(const Box& box, const Point3& origin);

/// Checks a scan piece by piece while it arrives. Not thread-safe. After an error only destruction.
class ScanVerifier {
  public:
    /// How many points will come: memory grows no further than that. It is taken by what arrives, at most
    /// twice that much, not by what is announced.
    void expect(std::uint64_t points) { expected_ = points; }

    /// What the points are relative to; finite. Before `finish`; otherwise 0, 0, 0.
    void setOrigin(const Point3& origin) { origin_ = origin; }

    /// Whole points as bytes; `size` is a multiple of 12. Errors: kNonFiniteCoordinate, naming the
    /// index of the point from 0 and the axis. Throws std::bad_alloc.
    [[nodiscard]] Result<void> append(const void* bytes, std::size_t size);

    [[nodiscard]] std::uint64_t pointCount() const noexcept { return xyz_.size() / 3; }

    /// `expected` is the checksum the sender announced; null: none. Errors: kChecksumMismatch;
    /// kCoordinateOutOfRange (the points are so far from 0, 0, 0 that single precision cannot hold them, as
    /// coarseInSinglePrecision of the main part; the origin is so far that double precision cannot, as
    /// coarseInDoublePrecision, or beyond kMaxCoordinate with them); those of `sanitise`: the points could
    /// never be segmented. What only the segmentation can see (no interior) is found later.
    [[nodiscard]] Result<VerifiedScan> finish(const Checksum* expected = nullptr);

  private:
    friend class VerifiedScan;
    Result<void> take(std::size_t first);
    Result<void> checkUsable() const;
    [[nodiscard]] Box box() const;
    [[nodiscard]] MainPart mainPart() const;
    Result<void> checkResolution() const;
    [[nodiscard]] Error withRemedy(Error error) const;

    std::vector<float> xyz_;
    std::uint64_t expected_ = 0;  ///< points; 0: not known
    Point3 origin_;
    Sha256 hash_;
    std::array<std::size_t, 6> extremes_{};  ///< points with the lowest x, y, z; with the highest
};

}  // namespace shapedb::store
