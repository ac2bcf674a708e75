// SPDX-License-Identifier: Apache-2.0
#include "client/api/packing.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>

#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "core/geometry/box.h"
#include "core/geometry/main_part.h"
#include "core/geometry/resolution.h"

namespace shapedb::client {

namespace {

constexpr double kLargest = std::numeric_limits<float>::max();
/// Below this diagonal float32 loses detail to subnormals: 2^24 times the smallest normal number.
constexpr double kSmallestDiagonal = static_cast<double>(std::numeric_limits<float>::min()) * 16777216.0;

std::string pointText(std::size_t index, const Point3& p) {
    char buffer[160];
    std::snprintf(buffer, sizeof buffer, "point %zu is (%g, %g, %g)", index, p.x, p.y, p.z);
    return buffer;
}

Result<Box> checkedBox(const PointCloud& points) {
    Box box;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Point3& p = points[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            return fail(ErrorCode::kNonFiniteCoordinate,
                        pointText(i, p) + "; remove such points before sending the scan");
        }
        if (std::abs(p.x) > kLargest || std::abs(p.y) > kLargest || std::abs(p.z) > kLargest) {
            return fail(ErrorCode::kCoordinateOutOfRange,
                        pointText(i, p) + ", beyond single precision (3.4e38); use a larger unit");
        }
        box.add(p);
    }
    return box;
}

/// What to subtract from the points. A few outliers, as at 0, 0, 0, do not count.
Point3 originFor(const PointCloud& points) {
    MainPart part = mainPartOf(points);
    if (part.isPoint()) part = {boxOf(points), points.size(), 0};
    const bool near = !isFarFromOrigin(part.box) && !coarseInSinglePrecision(part);
    return near ? Point3{} : part.box.low + 0.5 * part.box.extent();
}

void putFloat(char* to, double value) {
    const auto single = static_cast<float>(value);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &single, sizeof bits);
    for (int byte = 0; byte < 4; ++byte) to[byte] = static_cast<char>(bits >> (8 * byte));
}

double getFloat(const char* from) {
    std::uint32_t bits = 0;
    for (int byte = 0; byte < 4; ++byte) {
        bits |= static_cast<std::uint32_t>(static_cast<unsigned char>(from[byte])) << (8 * byte);
    }
    float single = 0.0f;
    std::memcpy(&single, &bits, sizeof single);
    return single;
}

}  // namespace

Result<PackedPoints> packPoints(const PointCloud& points) {
    if (points.empty()) {
        return fail(ErrorCode::kTooFewPoints, "the scan has no points; a shape needs at least 4");
    }
    const auto box = checkedBox(points);
    RETURN_IF_ERROR(box);
    // std::hypot: the square of 1e-300 is zero.
    const Point3 extent = box->extent();
    const double diagonal = std::hypot(extent.x, extent.y, extent.z);
    if (diagonal > 0.0 && diagonal < kSmallestDiagonal) {
        char buffer[160];
        std::snprintf(
            buffer, sizeof buffer,
            "the whole scan is only %g across, too small for single precision (%.2g); use a smaller unit",
            diagonal, kSmallestDiagonal);
        return fail(ErrorCode::kCoordinateOutOfRange, buffer);
    }

    RETURN_IF_ERROR(checkNotRounded(points));

    PackedPoints packed;
    packed.count = points.size();
    packed.origin = originFor(points);
    const Point3 reach{std::max(box->high.x - packed.origin.x, packed.origin.x - box->low.x),
                       std::max(box->high.y - packed.origin.y, packed.origin.y - box->low.y),
                       std::max(box->high.z - packed.origin.z, packed.origin.z - box->low.z)};
    if (const double most = std::max({reach.x, reach.y, reach.z}); most > kLargest) {
        char buffer[160];
        std::snprintf(buffer, sizeof buffer,
                      "a point lies %g away from most others, beyond single precision (3.4e38); drop it",
                      most);
        return fail(ErrorCode::kCoordinateOutOfRange, buffer);
    }
    packed.bytes.resize(points.size() * kPointBytes);
    char* to = packed.bytes.data();
    for (const Point3& p : points) {
        const Point3 shifted = p - packed.origin;
        putFloat(to, shifted.x);
        putFloat(to + 4, shifted.y);
        putFloat(to + 8, shifted.z);
        to += kPointBytes;
    }
    const Sha256Digest digest = sha256(packed.bytes.data(), packed.bytes.size());
    packed.sha256.assign(digest.begin(), digest.end());
    return packed;
}

Result<void> unpackPoints(const std::string& bytes, const Point3& origin, PointCloud& points) {
    if (bytes.size() % kPointBytes != 0) {
        return fail(ErrorCode::kMalformedStream, "the server sent a chunk of " +
                                                     std::to_string(bytes.size()) +
                                                     " bytes, not a whole number of points");
    }
    for (std::size_t at = 0; at < bytes.size(); at += kPointBytes) {
        const char* from = bytes.data() + at;
        const Point3 p{getFloat(from), getFloat(from + 4), getFloat(from + 8)};
        // Not even the sign of a zero changes for nothing.
        points.push_back(origin == Point3{} ? p : p + origin);
    }
    return {};
}

}  // namespace shapedb::client
