// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/verified_scan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>

#include "core/base/count_text.h"
#include "core/base/return_if_error.h"
#include "core/geometry/resolution.h"
#include "core/preparation/frame.h"
#include "core/preparation/sanitise.h"

// What travels and is stored is little-endian and used as it is.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "big-endian machines need a byte swap here");
static_assert(sizeof(float) == 4, "points travel as 32-bit floats");

namespace shapedb::store {

namespace {

/// Enough that a sample of a real scan spans space.
constexpr std::size_t kSamplePoints = 256;
/// Points of a shape.
constexpr std::size_t kFewest = 4;

constexpr char kSendRelative[] =
    "send points relative to an origin near them, which the field origin of the header names (their "
    "differences "
    "from it, in double precision)";

Point3 pointAt(const std::vector<float>& xyz, std::size_t i) {
    return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
}

}  // namespace

PointCloud toCloud(const std::vector<float>& xyz) {
    PointCloud points;
    points.reserve(xyz.size() / 3);
    for (std::size_t i = 0; i < xyz.size() / 3; ++i) points.push_back(pointAt(xyz, i));
    return points;
}

Result<void> checkPlacement(const Box& box, const Point3& origin) {
    if (origin == Point3{}) return {};
    const Box placed{box.low + origin, box.high + origin};
    for (const double value :
         {placed.low.x, placed.low.y, placed.low.z, placed.high.x, placed.high.y, placed.high.z}) {
        if (std::abs(value) <= kMaxCoordinate) continue;
        char text[128];
        std::snprintf(text, sizeof text,
                      "origin: with the points it gives coordinates up to %.3g, beyond 3.4e38", value);
        return fail(ErrorCode::kCoordinateOutOfRange, text);
    }
    if (const auto coarse = coarseInDoublePrecision(box, origin)) {
        return fail(ErrorCode::kCoordinateOutOfRange, "origin: " + coarse->text("double precision") +
                                                          ": use coordinates that begin nearer to the scan");
    }
    return {};
}

Result<VerifiedScan> VerifiedScan::verify(std::vector<float> xyz, const Point3& origin) {
    if (xyz.size() % 3 != 0) {
        return fail(ErrorCode::kInvalidArgument,
                    std::to_string(xyz.size()) + " numbers are not packed x y z");
    }
    ScanVerifier verifier;
    verifier.setOrigin(origin);
    verifier.xyz_ = std::move(xyz);
    RETURN_IF_ERROR(verifier.take(0));
    return verifier.finish();
}

Result<void> ScanVerifier::append(const void* bytes, std::size_t size) {
    const std::size_t first = xyz_.size();
    const std::size_t needed = first + size / sizeof(float);
    if (needed > xyz_.capacity()) {
        xyz_.reserve(std::max(needed, std::min<std::size_t>(3 * expected_, 2 * xyz_.capacity())));
    }
    xyz_.resize(needed);
    std::memcpy(xyz_.data() + first, bytes, size);
    return take(first);
}

/// Checks and hashes the points from number `first` on.
Result<void> ScanVerifier::take(std::size_t first) {
    for (std::size_t point = first / 3; point < xyz_.size() / 3; ++point) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float value = xyz_[3 * point + axis];
            if (!std::isfinite(value)) {
                return fail(ErrorCode::kNonFiniteCoordinate,
                            "point " + std::to_string(point) + ": " + "xyz"[axis] +
                                (std::isnan(value) ? " is NaN" : " is infinite or beyond single precision") +
                                ": drop such points before sending");
            }
            if (value < xyz_[3 * extremes_[axis] + axis]) extremes_[axis] = point;
            if (value > xyz_[3 * extremes_[3 + axis] + axis]) extremes_[3 + axis] = point;
        }
    }
    hash_.update(xyz_.data() + first, (xyz_.size() - first) * sizeof(float));
    return {};
}

Box ScanVerifier::box() const {
    Box box;
    for (const std::size_t i : extremes_) box.add(pointAt(xyz_, i));
    return box;
}

MainPart ScanVerifier::mainPart() const {
    return mainPartOf(xyz_.size() / 3, [&](std::size_t i) { return pointAt(xyz_, i); });
}

// A shape far from the origin loses its details in single precision.
Result<void> ScanVerifier::checkResolution() const {
    const MainPart part = mainPart();
    if (const auto coarse = coarseInSinglePrecision(part)) {
        return fail(ErrorCode::kCoordinateOutOfRange, coarse->text() + ": " + kSendRelative);
    }
    if (part.isPoint() && part.outliers > 0 && maybeFlattened(part)) {
        return fail(ErrorCode::kCoordinateOutOfRange,
                    "in single precision all points but " + std::to_string(part.outliers) +
                        " are the same one: if they differed before, " + kSendRelative);
    }
    if (!part.isPoint()) RETURN_IF_ERROR(checkPlacement(part.box, origin_));
    // Of all points, which is the rule for those that are stored.
    return checkPlacement(box(), origin_);
}

/// Looks at a sample first: adding points cannot flatten a sample that spans space, and the
/// points at the extremes decide what is wrong with size or magnitude. Only when the sample is
/// refused are all points looked at, which takes about 80 bytes a point.
Result<void> ScanVerifier::checkUsable() const {
    const std::size_t count = xyz_.size() / 3;
    if (count > 0) {
        RETURN_IF_ERROR(checkResolution());
        PointCloud sample;
        for (const std::size_t i : extremes_) sample.push_back(pointAt(xyz_, i));
        const std::size_t step = std::max<std::size_t>(1, count / kSamplePoints);
        for (std::size_t i = 0; i < count; i += step) sample.push_back(pointAt(xyz_, i));
        if (sanitise(sample)) return {};
    }
    const auto sanitised = sanitise(toCloud(xyz_));
    if (!sanitised) return fail(withRemedy(sanitised.error()));
    return {};
}

/// Of points that seem to be no shape: what else can be the reason, and what then helps.
Error ScanVerifier::withRemedy(Error error) const {
    const bool flat = error.code == ErrorCode::kAllPointsEqual || error.code == ErrorCode::kTooFewPoints ||
                      error.code == ErrorCode::kCollinear || error.code == ErrorCode::kCoplanar;
    if (!flat || xyz_.size() < 3 * kFewest) return error;
    const MainPart part = mainPart();
    if (part.outliers > 0 && box().diagonal() * kFlatnessTolerance > part.box.diagonal()) {
        error.message += ". All but " + countText(part.outliers, "point") +
                         " round to the same point at that distance: drop those that lie far away";
    } else if (maybeFlattened(part)) {
        error.message +=
            std::string(". If the points were other ones before they were written in single precision, ") +
            kSendRelative;
    }
    return error;
}

Result<VerifiedScan> ScanVerifier::finish(const Checksum* expected) {
    const Checksum checksum = hash_.finish();
    if (expected != nullptr && *expected != checksum) {
        return fail(ErrorCode::kChecksumMismatch,
                    "the points received have the SHA-256 " + toHex(checksum) +
                        ", which is not the one in the header: send the scan again");
    }
    RETURN_IF_ERROR(checkUsable());
    return VerifiedScan(std::move(xyz_), checksum, origin_);
}

}  // namespace shapedb::store
