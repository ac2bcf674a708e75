// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/scan_upload.h"

#include <algorithm>

#include "core/base/count_text.h"
#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"

namespace shapedb::catalog {

Result<void> ScanUpload::begin(std::uint64_t announced, const std::string& sha256, const Point3& origin) {
    if (announced_)
        return fail(ErrorCode::kMalformedStream, "a second header arrived; send one, before the chunks");
    if (announced < kMinPoints) {
        return fail(ErrorCode::kTooFewPoints, "point_count: " + countText(announced, "point") +
                                                  ", a scan needs at least " + std::to_string(kMinPoints));
    }
    if (announced > maxPoints_) {
        return fail(ErrorCode::kPointLimitExceeded,
                    "point_count: " + std::to_string(announced) + " points, this server takes at most " +
                        std::to_string(maxPoints_) + " (limits.max_points): send fewer points");
    }
    if (!sha256.empty()) {
        store::Checksum& expected = expected_.emplace();
        if (sha256.size() != expected.size()) {
            return fail(ErrorCode::kInvalidArgument,
                        "sha256: " + std::to_string(sha256.size()) + " bytes, must be 32 or empty");
        }
        std::copy(sha256.begin(), sha256.end(), expected.begin());
    }
    RETURN_IF_ERROR(checkOrigin(origin));
    announced_ = announced;
    verifier_.expect(announced);
    verifier_.setOrigin(origin);
    return {};
}

Result<void> ScanUpload::checkChunk(const std::string& xyz) const {
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
        return fail(ErrorCode::kCountMismatch, "received more points than the " +
                                                   std::to_string(*announced_) + " announced in the header");
    }
    return {};
}

Result<void> ScanUpload::add(const std::string& xyz) {
    RETURN_IF_ERROR(checkChunk(xyz));
    RETURN_IF_ERROR(share_.take(xyz.size()));
    return verifier_.append(xyz.data(), xyz.size());
}

Result<store::VerifiedScan> ScanUpload::finish() {
    if (!announced_) return fail(ErrorCode::kMalformedStream, "the stream ended before a header arrived");
    if (points() != *announced_) {
        return fail(ErrorCode::kCountMismatch, std::to_string(points()) +
                                                   " points received, the header announced " +
                                                   std::to_string(*announced_));
    }
    return verifier_.finish(expected_ ? &*expected_ : nullptr);
}

Result<store::VerifiedScan> isolated(store::VerifiedScan scan, const IsolateOptions& options,
                                     const RunContext& context) {
    if (!options.any()) return scan;
    const auto scene = findScene(store::toCloud(scan.points()), context);
    RETURN_IF_ERROR(scene);
    std::vector<float> kept;
    for (std::size_t i = 0; i < scene->objectOfPoint.size(); ++i) {
        if (!options.keeps(scene->objectOfPoint[i])) continue;
        const auto first = scan.points().begin() + static_cast<std::ptrdiff_t>(3 * i);
        kept.insert(kept.end(), first, first + 3);
    }
    if (kept.size() == scan.points().size()) return scan;
    auto rest = store::VerifiedScan::verify(std::move(kept), scan.origin());
    if (!rest) return fail(withContext(rest.error(), "without its plane and other objects: "));
    return rest;
}

}  // namespace shapedb::catalog
