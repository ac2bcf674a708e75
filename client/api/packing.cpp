#include "client/api/packing.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>

#include "client/api/types.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr double kLargest = std::numeric_limits<float>::max();
/// Below this diagonal float32 loses detail to subnormals: 2^24 times the smallest normal number.
constexpr double kSmallestDiagonal = static_cast<double>(std::numeric_limits<float>::min()) * 16777216.0;

struct Extent {
    Point3 low;
    Point3 high;

    // std::hypot: the square of 1e-300 is zero.
    [[nodiscard]] double diagonal() const {
        return std::hypot(high.x - low.x, high.y - low.y, high.z - low.z);
    }
    [[nodiscard]] double farthest() const {
        return std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), std::abs(high.x),
                         std::abs(high.y), std::abs(high.z)});
    }
};

std::string pointText(std::size_t index, const Point3& p) {
    char buffer[160];
    std::snprintf(buffer, sizeof buffer, "point %zu is (%g, %g, %g)", index, p.x, p.y, p.z);
    return buffer;
}

Result<Extent> extentOf(const PointCloud& points) {
    Extent extent{points.front(), points.front()};
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
        extent.low = {std::min(extent.low.x, p.x), std::min(extent.low.y, p.y), std::min(extent.low.z, p.z)};
        extent.high = {std::max(extent.high.x, p.x), std::max(extent.high.y, p.y),
                       std::max(extent.high.z, p.z)};
    }
    return extent;
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
    const auto extent = extentOf(points);
    RETURN_IF_ERROR(extent);
    const double diagonal = extent->diagonal();
    if (diagonal > 0.0 && diagonal < kSmallestDiagonal) {
        char buffer[160];
        std::snprintf(
            buffer, sizeof buffer,
            "the whole scan is only %g across, too small for single precision (%.2g); use a smaller unit",
            diagonal, kSmallestDiagonal);
        return fail(ErrorCode::kCoordinateOutOfRange, buffer);
    }

    PackedPoints packed;
    packed.count = points.size();
    if (diagonal > 0.0 && extent->farthest() > kFarFromOrigin * diagonal) {
        packed.offset = extent->low + 0.5 * (extent->high - extent->low);
    }
    packed.bytes.resize(points.size() * kPointBytes);
    char* to = packed.bytes.data();
    for (const Point3& p : points) {
        const Point3 shifted = p - packed.offset;
        putFloat(to, shifted.x);
        putFloat(to + 4, shifted.y);
        putFloat(to + 8, shifted.z);
        to += kPointBytes;
    }
    const Sha256Digest digest = sha256(packed.bytes.data(), packed.bytes.size());
    packed.sha256.assign(digest.begin(), digest.end());
    return packed;
}

Result<void> unpackPoints(const std::string& bytes, PointCloud& points) {
    if (bytes.size() % kPointBytes != 0) {
        return fail(ErrorCode::kMalformedStream, "the server sent a chunk of " +
                                                     std::to_string(bytes.size()) +
                                                     " bytes, not a whole number of points");
    }
    for (std::size_t at = 0; at < bytes.size(); at += kPointBytes) {
        const char* from = bytes.data() + at;
        points.push_back({getFloat(from), getFloat(from + 4), getFloat(from + 8)});
    }
    return {};
}

std::string offsetText(const Point3& offset) {
    char buffer[120];
    std::snprintf(buffer, sizeof buffer, "%.17g %.17g %.17g", offset.x, offset.y, offset.z);
    return buffer;
}

Result<Point3> offsetOf(const std::string& text) {
    std::array<double, 3> numbers{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (double& number : numbers) {
        while (at != end && *at == ' ') ++at;
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc()) at = nullptr;
        if (at == nullptr) break;
        at = next;
    }
    if (at != end ||
        !std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); })) {
        return fail(ErrorCode::kDataLoss,
                    std::string("metadata ") + kOffsetKey + ": '" + text + "' is not three numbers");
    }
    return Point3{numbers[0], numbers[1], numbers[2]};
}

}  // namespace shapedb::client
