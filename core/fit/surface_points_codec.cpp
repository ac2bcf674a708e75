#include "core/fit/surface_points_codec.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>

#include <zlib.h>

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

std::uint32_t checksumOf(const char* bytes, std::size_t size) {
    return static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(bytes), static_cast<uInt>(size)));
}

template <typename Unsigned>
void put(std::string& out, Unsigned value) {
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i)
        out.push_back(static_cast<char>((value >> (8 * i)) & 0xffu));
}

void putDouble(std::string& out, double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    put(out, bits);
}

template <typename Unsigned>
Unsigned take(const char*& at) {
    Unsigned value = 0;
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
        // Shifts instead of a copy: the same on machines of either byte order.
        value = static_cast<Unsigned>(value |
                                      (static_cast<Unsigned>(static_cast<unsigned char>(at[i])) << (8 * i)));
    }
    at += sizeof(Unsigned);
    return value;
}

double takeDouble(const char*& at) {
    const auto bits = take<std::uint64_t>(at);
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

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
    const char* at = bytes.data() + 5;
    if (take<std::uint8_t>(at) != 0) return damaged("a reserved byte is not 0");
    const std::size_t count = take<std::uint16_t>(at);
    if (count < kLeastPoints || count > kMostSurfacePoints) {
        return damaged(std::to_string(count) + " points instead of 4 to " +
                       std::to_string(kMostSurfacePoints));
    }
    if (bytes.size() != sizeOf(count)) {
        return damaged(std::to_string(bytes.size()) + " bytes instead of " + std::to_string(sizeOf(count)));
    }
    const std::size_t body = bytes.size() - kChecksumBytes;
    const char* end = bytes.data() + body;
    if (take<std::uint32_t>(end) != checksumOf(bytes.data(), body)) return damaged("the checksum is wrong");
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
    put(bytes, kVersion);
    put(bytes, std::uint8_t{0});
    put(bytes, static_cast<std::uint16_t>(surface.size()));
    for (const double v : {surface.centre.x, surface.centre.y, surface.centre.z, surface.unit}) {
        putDouble(bytes, v);
    }
    for (const PackedSurfacePoint& p : surface.points) {
        for (const std::int16_t v : p.position) put(bytes, static_cast<std::uint16_t>(v));
        for (const std::int8_t v : p.normal) put(bytes, static_cast<std::uint8_t>(v));
    }
    put(bytes, checksumOf(bytes.data(), bytes.size()));
    return bytes;
}

Result<SurfacePoints> decodeSurfacePoints(const std::string& bytes) {
    const auto count = checkedCount(bytes);
    if (!count) return fail(count.error());
    try {
        SurfacePoints surface;
        surface.points.reserve(*count);
        const char* at = bytes.data() + 8;
        for (double* v : {&surface.centre.x, &surface.centre.y, &surface.centre.z, &surface.unit}) {
            *v = takeDouble(at);
        }
        for (std::size_t i = 0; i < *count; ++i) {
            PackedSurfacePoint p;
            for (std::int16_t& v : p.position) v = static_cast<std::int16_t>(take<std::uint16_t>(at));
            for (std::int8_t& v : p.normal) v = static_cast<std::int8_t>(take<std::uint8_t>(at));
            surface.points.push_back(p);
        }
        if (const auto checked = checkNumbers(surface); !checked) return fail(checked.error());
        return surface;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to read surface points");
    }
}

}  // namespace shapedb
