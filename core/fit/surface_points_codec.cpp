// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/surface_points_codec.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>

#include "core/base/return_if_error.h"
#include "core/base/stored_bytes.h"
#include "core/preparation/frame.h"

namespace shapedb {

namespace {

// Persisted: never change. docs/fit.md describes every byte.
constexpr char kMagic[4] = {'S', 'D', 'B', 'F'};
constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 40;
constexpr std::size_t kPointBytes = 8;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::size_t kLeastPoints = 4;

constexpr std::size_t sizeOf(std::size_t points) {
    return kHeaderBytes + kPointBytes * points + kChecksumBytes;
}

// The centre of a scan whose coordinates frameOf accepts lies no further out; surface points may fill a small
// part of the frame of a scan with far outliers.
constexpr double kLargestCentre = 1.01 * kMaxCoordinate;
constexpr double kLargestUnit = 2.0 * kMaxCoordinate;
constexpr double kSmallestUnit = 1e-45;

tl::unexpected<Error> damaged(const std::string& how) {
    return fail(ErrorCode::kDataLoss, "the stored surface points are damaged: " + how);
}

// Length, magic, version, number of points and checksum.
Result<std::size_t> checkedCount(const std::string& bytes) {
    if (bytes.size() < sizeOf(kLeastPoints))
        return damaged("only " + std::to_string(bytes.size()) + " bytes");
    if (std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) return damaged("they do not begin with SDBF");
    const auto version = static_cast<std::uint8_t>(bytes[4]);
    if (version == 0) return damaged("version 0");
    if (version > kVersion) {
        return fail(ErrorCode::kSchemaTooNew, "the stored surface points have version " +
                                                  std::to_string(version) + "; this program knows up to " +
                                                  std::to_string(kVersion));
    }
    ByteReader reader(bytes.data() + 5);
    if (reader.takeUnsigned<std::uint8_t>() != 0) return damaged("a reserved byte is not 0");
    const std::size_t count = reader.takeUnsigned<std::uint16_t>();
    if (count < kLeastPoints || count > kMostSurfacePoints) {
        return damaged(std::to_string(count) + " points instead of 4 to " +
                       std::to_string(kMostSurfacePoints));
    }
    if (bytes.size() != sizeOf(count)) {
        return damaged(std::to_string(bytes.size()) + " bytes instead of " + std::to_string(sizeOf(count)));
    }
    const std::size_t body = bytes.size() - kChecksumBytes;
    if (ByteReader(bytes.data() + body).takeUnsigned<std::uint32_t>() != checksumOf(bytes.data(), body)) {
        return damaged("the checksum is wrong");
    }
    return count;
}

Result<void> checkNumbers(const SurfacePoints& surface) {
    for (const double v : {surface.centre.x, surface.centre.y, surface.centre.z}) {
        if (!std::isfinite(v) || std::abs(v) > kLargestCentre) return damaged("the centre is out of range");
    }
    if (!(surface.unit >= kSmallestUnit && surface.unit <= kLargestUnit)) {
        return damaged("the unit is out of range");
    }
    int low[3] = {kSurfaceSteps, kSurfaceSteps, kSurfaceSteps};
    int high[3] = {-kSurfaceSteps, -kSurfaceSteps, -kSurfaceSteps};
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
        const PackedSurfacePoint& p = surface.points[i];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (p.position[axis] < -kSurfaceSteps) {
                return damaged("a coordinate of point " + std::to_string(i) + " is out of range");
            }
            low[axis] = std::min<int>(low[axis], p.position[axis]);
            high[axis] = std::max<int>(high[axis], p.position[axis]);
        }
        if (p.normal[0] < -127 || p.normal[1] < -127) {
            return damaged("the normal of point " + std::to_string(i) + " is out of range");
        }
    }
    // The points fill their frame along its longest side: what fits them may divide by their extent.
    int longest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) longest = std::max(longest, high[axis] - low[axis]);
    if (longest < 2 * kSurfaceSteps - 2) return damaged("the points do not fill their frame");
    return {};
}

}  // namespace

std::string encodeSurfacePoints(const SurfacePoints& surface) {
    std::string bytes;
    bytes.reserve(sizeOf(surface.size()));
    bytes.append(kMagic, sizeof kMagic);
    putUnsigned(bytes, kVersion);
    putUnsigned(bytes, std::uint8_t{0});
    putUnsigned(bytes, static_cast<std::uint16_t>(surface.size()));
    for (const double v : {surface.centre.x, surface.centre.y, surface.centre.z, surface.unit}) {
        putDouble(bytes, v);
    }
    for (const PackedSurfacePoint& p : surface.points) {
        for (const std::int16_t v : p.position) putUnsigned(bytes, static_cast<std::uint16_t>(v));
        for (const std::int8_t v : p.normal) putUnsigned(bytes, static_cast<std::uint8_t>(v));
    }
    putUnsigned(bytes, checksumOf(bytes.data(), bytes.size()));
    return bytes;
}

Result<SurfacePoints> decodeSurfacePoints(const std::string& bytes) {
    const auto count = checkedCount(bytes);
    RETURN_IF_ERROR(count);
    try {
        SurfacePoints surface;
        surface.points.reserve(*count);
        ByteReader reader(bytes.data() + 8);
        for (double* v : {&surface.centre.x, &surface.centre.y, &surface.centre.z, &surface.unit}) {
            *v = reader.takeDouble();
        }
        for (std::size_t i = 0; i < *count; ++i) {
            PackedSurfacePoint p;
            for (std::int16_t& v : p.position)
                v = static_cast<std::int16_t>(reader.takeUnsigned<std::uint16_t>());
            for (std::int8_t& v : p.normal) v = static_cast<std::int8_t>(reader.takeUnsigned<std::uint8_t>());
            surface.points.push_back(p);
        }
        RETURN_IF_ERROR(checkNumbers(surface));
        return surface;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to read surface points");
    }
}

}  // namespace shapedb
