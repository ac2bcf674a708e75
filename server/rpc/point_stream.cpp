#include "server/rpc/point_stream.h"

#include <cmath>
#include <cstring>
#include <new>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/rpc/limits.h"

// What travels is little-endian and is used as it is.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "big-endian machines need a byte swap here");
static_assert(sizeof(float) == 4, "points travel as 32-bit floats");

namespace shapedb::rpc {

Result<void> PointReceiver::begin(std::uint64_t announced, const std::string& sha256) {
    if (announced_) return fail(ErrorCode::kMalformedStream, "second header: exactly one must come, first");
    if (announced < kMinPoints) {
        return fail(ErrorCode::kTooFewPoints, "point_count: " + std::to_string(announced) +
                                                  " points, a scan needs at least " +
                                                  std::to_string(kMinPoints));
    }
    if (announced > maxPoints_) {
        return fail(ErrorCode::kPointLimitExceeded, "point_count: " + std::to_string(announced) +
                                                        " points, this server takes at most " +
                                                        std::to_string(maxPoints_) + ": thin the scan out");
    }
    if (!sha256.empty() && sha256.size() != scan_.checksum.size()) {
        return fail(ErrorCode::kInvalidArgument,
                    "sha256: " + std::to_string(sha256.size()) + " bytes, must be 32 or empty");
    }
    announced_ = announced;
    wantedChecksum_ = sha256;
    setAside(announced);
    return {};
}

void PointReceiver::setAside(std::uint64_t points) {
    try {
        scan_.xyz.reserve(3 * static_cast<std::size_t>(points));
    } catch (const std::bad_alloc&) {
        // A machine that commits no more than it has: what arrives decides.
    }
}

Result<void> PointReceiver::checkChunk(const std::string& xyz) const {
    const auto malformed = [&](const std::string& what) {
        return fail(ErrorCode::kMalformedStream,
                    "chunk after " + std::to_string(points()) + " points: " + what);
    };
    if (!announced_)
        return fail(ErrorCode::kMalformedStream, "chunk before the header: the header comes first");
    if (xyz.empty()) return malformed("it is empty");
    if (xyz.size() > kMaxChunkBytes) {
        return malformed(std::to_string(xyz.size()) + " bytes, at most " + std::to_string(kMaxChunkBytes) +
                         " are allowed");
    }
    if (xyz.size() % kPointBytes != 0) {
        return malformed(std::to_string(xyz.size()) + " bytes are not a whole number of points of " +
                         std::to_string(kPointBytes) + " bytes");
    }
    if (points() == *announced_) {
        return malformed("all " + std::to_string(*announced_) + " announced points had already come");
    }
    if (points() + xyz.size() / kPointBytes > *announced_) {
        return fail(ErrorCode::kCountMismatch,
                    "more points came than the " + std::to_string(*announced_) + " announced in the header");
    }
    return {};
}

Result<void> PointReceiver::add(const std::string& xyz) {
    RETURN_IF_ERROR(checkChunk(xyz));
    RETURN_IF_ERROR(share_.take(xyz.size()));
    const std::size_t before = scan_.xyz.size();
    scan_.xyz.resize(before + xyz.size() / sizeof(float));
    std::memcpy(scan_.xyz.data() + before, xyz.data(), xyz.size());
    for (std::size_t i = before; i < scan_.xyz.size(); ++i) {
        if (!std::isfinite(scan_.xyz[i])) {
            return fail(
                ErrorCode::kNonFiniteCoordinate,
                "point " + std::to_string(i / 3) + ": " + "xyz"[i % 3] +
                    (std::isnan(scan_.xyz[i]) ? " is NaN" : " is infinite or beyond single precision") +
                    ": drop such points before sending");
        }
    }
    hash_.update(xyz.data(), xyz.size());
    return {};
}

Result<ReceivedScan> PointReceiver::finish() {
    if (!announced_) return fail(ErrorCode::kMalformedStream, "the stream ended before a header came");
    if (points() != *announced_) {
        return fail(
            ErrorCode::kCountMismatch,
            std::to_string(points()) + " points came, the header announced " + std::to_string(*announced_));
    }
    scan_.checksum = hash_.finish();
    if (!wantedChecksum_.empty() &&
        std::memcmp(wantedChecksum_.data(), scan_.checksum.data(), scan_.checksum.size()) != 0) {
        return fail(ErrorCode::kChecksumMismatch,
                    "the points that came have the SHA-256 " + toHex(scan_.checksum) +
                        ", which is not the one in the header: send the scan again");
    }
    return std::move(scan_);
}

}  // namespace shapedb::rpc
