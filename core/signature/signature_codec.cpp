// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/signature_codec.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>

#include "core/base/return_if_error.h"
#include "core/base/stored_bytes.h"

namespace shapedb {

namespace {

// Persisted: never change. docs/signature-format.md describes every byte.
constexpr char kMagic[4] = {'S', 'D', 'B', 'G'};
constexpr std::uint16_t kPointsOnly = 1;  // version 1: points with their volume shares
constexpr std::uint16_t kWithRoots = 2;   // version 2: statistics, one byte per bin; no volume shares
constexpr std::uint16_t kWithLevels = 3;  // version 3: statistics as levels, two per byte
constexpr std::uint16_t kWithChange = 4;  // version 4: inside distances are right; one statistic more
constexpr std::size_t kHeaderBytes = 52;
constexpr std::size_t kChecksumBytes = 4;

// What differs between versions.
struct Layout {
    std::size_t pointBytes;
    std::size_t statisticBytes;

    constexpr std::size_t size(std::size_t points) const {
        return kHeaderBytes + pointBytes * points + statisticBytes + kChecksumBytes;
    }
};
constexpr Layout layoutOf(std::uint16_t version) {
    switch (version) {
        case kWithRoots: return {44, kEarlierStatisticBins};
        case kWithLevels: return {44, kEarlierStatisticBins / 2};
        case kWithChange: return {44, kStatisticBins / 2};
        default: return {48, 0};
    }
}
static_assert(kStatisticBins % 2 == 0 && kEarlierStatisticBins % 2 == 0, "two levels per byte");
constexpr std::size_t kLeastBytes = layoutOf(kPointsOnly).size(1);

// Scan units. No scan that `sanitise` accepts exceeds these, beyond which a motion between two shapes would
// overflow.
constexpr double kLargestSize = 1e40;
constexpr double kSmallestSize = 1e-40;

// By this much the weight of a single segment, rounded to a float, may exceed the volume.
constexpr double kShareRounding = 1e-6;

WeightedPoint takePoint(ByteReader& reader, std::uint16_t version, const Signature& of) {
    WeightedPoint point;
    for (float& v : point.position) v = reader.takeFloat();
    point.weight = reader.takeFloat();
    point.volumeShare =
        version == kPointsOnly ? reader.takeFloat() : volumeShareOf(point.weight, of.scale, of.volume);
    point.maximumRadius = reader.takeFloat();
    for (float& v : point.covariance) v = reader.takeFloat();
    return point;
}

bool allFinite(const WeightedPoint& point) {
    bool finite =
        std::isfinite(point.weight) && std::isfinite(point.volumeShare) && std::isfinite(point.maximumRadius);
    for (const float v : point.position) finite = finite && std::isfinite(v);
    for (const float v : point.covariance) finite = finite && std::isfinite(v);
    return finite;
}

tl::unexpected<Error> malformed(const std::string& what) {
    return fail(ErrorCode::kMalformedSignature, "not a valid signature: " + what);
}

Result<void> checkNumbers(const Signature& signature, std::uint16_t version) {
    const Point3& o = signature.origin;
    if (!(signature.scale >= kSmallestSize && signature.scale <= kLargestSize))
        return malformed("the scale is not between 1e-40 and 1e40");
    if (!std::isfinite(signature.volume) || signature.volume <= 0.0)
        return malformed("the volume is not positive");
    if (!std::isfinite(o.x) || !std::isfinite(o.y) || !std::isfinite(o.z)) {
        return malformed("the origin is not finite");
    }
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        const WeightedPoint& p = signature.points[i];
        const auto name = [i] { return "point " + std::to_string(i); };
        if (!allFinite(p)) return malformed(name() + " has a number that is not finite");
        if (!(p.weight > 0.0f)) return malformed(name() + " has no positive weight");
        // The volume share, computed from these, is cut off at 1 and would hide it.
        const double cube = signature.scale * signature.scale * signature.scale;
        if (version != kPointsOnly && p.weight * cube > signature.volume * (1.0 + kShareRounding))
            return malformed(name() + " outweighs the whole volume");
        if (!(p.volumeShare > 0.0f) || p.volumeShare > 1.0f)
            return malformed(name() + " has a volume share outside (0, 1]");
        if (!(p.maximumRadius > 0.0f))
            return malformed(name() + " has a largest ball without a positive radius");
        if (i > 0 && p.weight > signature.points[i - 1].weight)
            return malformed(name() + " is heavier than the one before");
    }
    if (signature.points.front().position != std::array<float, 3>{}) {
        return malformed("the heaviest point is not at the origin");
    }
    return {};
}

std::size_t binsOf(std::uint16_t version) {
    return version == kWithChange ? kStatisticBins : kEarlierStatisticBins;
}

void putStatistics(std::string& out, const ShapeStatistics& levels, std::uint16_t version) {
    for (std::size_t i = 0; i < binsOf(version); i += 2) {
        putUnsigned(out, static_cast<std::uint8_t>(levels[i] | (levels[i + 1] << 4)));
    }
}

ShapeStatistics takeStatistics(ByteReader& reader, std::uint16_t version) {
    ShapeStatistics levels{};
    for (std::size_t i = 0; i < binsOf(version);) {
        const auto byte = reader.takeUnsigned<std::uint8_t>();
        if (version == kWithRoots) {
            levels[i++] = levelOfRootByte(byte);
        } else {
            levels[i++] = byte & 0x0fu;
            levels[i++] = byte >> 4;
        }
    }
    return levels;
}

std::uint16_t versionOf(const Signature& signature) {
    if (!signature.attributes) return kPointsOnly;
    return signature.attributes->earlier ? kWithLevels : kWithChange;
}

}  // namespace

std::string encodeSignature(const Signature& signature) {
    std::string out(kMagic, sizeof kMagic);
    const std::uint16_t version = versionOf(signature);
    out.reserve(layoutOf(version).size(signature.points.size()));
    putUnsigned(out, version);
    putUnsigned(out, static_cast<std::uint16_t>(signature.points.size()));
    putUnsigned(out, signature.attributes ? std::uint32_t{signature.attributes->quality} : 0u);
    putDouble(out, signature.scale);
    putDouble(out, signature.origin.x);
    putDouble(out, signature.origin.y);
    putDouble(out, signature.origin.z);
    putDouble(out, signature.volume);
    for (const WeightedPoint& point : signature.points) {
        for (const float v : point.position) putFloat(out, v);
        putFloat(out, point.weight);
        if (version == kPointsOnly) putFloat(out, point.volumeShare);
        putFloat(out, point.maximumRadius);
        for (const float v : point.covariance) putFloat(out, v);
    }
    if (signature.attributes) putStatistics(out, signature.attributes->statistics, version);
    putUnsigned(out, checksumOf(out.data(), out.size()));
    return out;
}

Result<Signature> decodeSignature(const std::string& bytes) {
    Signature signature;
    RETURN_IF_ERROR(decodeSignature(bytes, signature));
    return signature;
}

Result<void> decodeSignature(const std::string& bytes, Signature& signature) {
    if (bytes.size() < kLeastBytes) {
        return malformed(std::to_string(bytes.size()) + " bytes are too few");
    }
    if (std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
        return malformed("it does not begin with SDBG");
    ByteReader reader(bytes.data() + sizeof kMagic);
    const auto version = reader.takeUnsigned<std::uint16_t>();
    if (version < kPointsOnly || version > kWithChange)
        return malformed("version " + std::to_string(version) + " is unknown");
    const auto count = reader.takeUnsigned<std::uint16_t>();
    if (count < 1 || count > kMaxSignaturePoints)
        return malformed(std::to_string(count) + " points announced");
    if (bytes.size() != layoutOf(version).size(count)) {
        return malformed(std::to_string(bytes.size()) + " bytes do not fit " + std::to_string(count) +
                         " points");
    }
    ByteReader checksum(bytes.data() + bytes.size() - kChecksumBytes);
    if (checksum.takeUnsigned<std::uint32_t>() != checksumOf(bytes.data(), bytes.size() - kChecksumBytes)) {
        return malformed("the checksum does not agree");
    }
    const auto quality = reader.takeUnsigned<std::uint32_t>();
    if (quality > (version == kPointsOnly ? 0u : 255u)) return malformed("reserved bytes are in use");
    try {
        signature.scale = reader.takeDouble();
        signature.origin.x = reader.takeDouble();
        signature.origin.y = reader.takeDouble();
        signature.origin.z = reader.takeDouble();
        signature.volume = reader.takeDouble();
        signature.points.clear();
        signature.points.reserve(count);
        for (std::uint16_t i = 0; i < count; ++i) {
            signature.points.push_back(takePoint(reader, version, signature));
        }
        RETURN_IF_ERROR(checkNumbers(signature, version));
        if (version == kPointsOnly) {
            signature.attributes.reset();
        } else {
            if (!signature.attributes) signature.attributes.emplace();
            ShapeAttributes& attributes = *signature.attributes;
            attributes.quality = static_cast<std::uint8_t>(quality);
            attributes.earlier = version < kWithChange;
            attributes.statistics = takeStatistics(reader, version);
            setBody(signature.points, attributes.body);
        }
        return {};
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to decode a signature");
    }
}

}  // namespace shapedb
