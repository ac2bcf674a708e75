// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/signature.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

#include "core/base/return_if_error.h"
#include "core/signature/covariance.h"

namespace shapedb {

Result<void> validate(const SignatureOptions& options) {
    if (options.maxPoints >= 1 && options.maxPoints <= kMaxSignaturePoints) return {};
    return fail(ErrorCode::kInvalidArgument, "max_points is " + std::to_string(options.maxPoints) +
                                                 "; it must be 1 to " + std::to_string(kMaxSignaturePoints));
}

float volumeShareOf(float weight, double scale, double volume) noexcept {
    const double share = static_cast<double>(weight) * (scale * scale * scale) / volume;
    return static_cast<float>(std::min(1.0, share));
}

bool sameShape(const Signature& a, const Signature& b) noexcept {
    if (a.attributes.has_value() != b.attributes.has_value()) return false;
    // With attributes, the points themselves enter no score.
    if (a.attributes) {
        return a.attributes->quality == b.attributes->quality &&
               a.attributes->earlier == b.attributes->earlier &&
               a.attributes->statistics == b.attributes->statistics &&
               a.attributes->body.segments == b.attributes->body.segments;
    }
    if (a.points.size() != b.points.size()) return false;
    for (std::size_t i = 0; i < a.points.size(); ++i) {
        const WeightedPoint& p = a.points[i];
        const WeightedPoint& q = b.points[i];
        if (p.position != q.position || p.weight != q.weight) return false;
    }
    return true;
}

void moveBy(const Point3& offset, Signature& signature) {
    // Not even the sign of a zero changes for nothing.
    if (offset != Point3{}) signature.origin = signature.origin + offset;
}

Point3 pointPosition(const Signature& signature, std::size_t i) {
    const auto& p = signature.points[i].position;
    return signature.origin + signature.scale * Point3{p[0], p[1], p[2]};
}

double pointVolume(const Signature& signature, std::size_t i) {
    return static_cast<double>(signature.points[i].weight) * signature.scale * signature.scale *
           signature.scale;
}

std::array<double, 3> pointExtents(const Signature& signature, std::size_t i) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
        covarianceMatrix(signature.points[i].covariance), Eigen::EigenvaluesOnly);
    const auto& rising = solver.eigenvalues();
    std::array<double, 3> extents;
    for (int axis = 0; axis < 3; ++axis) {
        // Rounding may push the smallest eigenvalue of a flat segment below zero.
        extents[static_cast<std::size_t>(axis)] =
            signature.scale * std::sqrt(std::max(0.0, rising[2 - axis]));
    }
    return extents;
}

namespace {

Result<Signature> makeSignatureOrThrow(const Segmentation& segmentation, const SignatureOptions& options) {
    if (segmentation.segments.empty() || !(segmentation.size > 0.0)) {
        return fail(ErrorCode::kNoInterior, "the shape has no segments to describe");
    }
    Signature signature;
    signature.scale = segmentation.size;
    signature.volume = segmentation.volume;
    signature.origin = segmentation.segments.front().centroid;
    const double inverse = 1.0 / segmentation.size;
    const std::size_t count = std::min<std::size_t>(options.maxPoints, segmentation.segments.size());
    for (std::size_t i = 0; i < count; ++i) {
        const Segment& segment = segmentation.segments[i];
        const Point3 position = inverse * (segment.centroid - signature.origin);
        WeightedPoint point;
        point.position = {static_cast<float>(position.x), static_cast<float>(position.y),
                          static_cast<float>(position.z)};
        point.weight = static_cast<float>(segment.volume * inverse * inverse * inverse);
        point.volumeShare = volumeShareOf(point.weight, signature.scale, signature.volume);
        // The largest ball of a segment without a maximum may be that of a flat tetrahedron, of any radius.
        point.maximumRadius = static_cast<float>(
            std::min<double>(segment.maximumRadius * inverse, std::numeric_limits<float>::max()));
        for (std::size_t m = 0; m < 6; ++m) {
            point.covariance[m] = static_cast<float>(segment.covariance[m] * inverse * inverse);
        }
        // Too light for single precision, and so are all that follow.
        if (!(point.weight > 0.0f) || !(point.volumeShare > 0.0f)) break;
        signature.points.push_back(point);
    }
    if (signature.points.empty()) {
        return fail(ErrorCode::kNoInterior,
                    "the interior is too small for the size of the scan to be described");
    }
    return signature;
}

Result<ShapeAttributes> attributesOf(const Segmentation& segmentation, const Signature& signature,
                                     const RunContext& context) {
    auto statistics = shapeStatistics(interiorView(segmentation), context);
    RETURN_IF_ERROR(statistics);
    ShapeAttributes attributes;
    attributes.statistics = *statistics;
    attributes.quality =
        static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(segmentation.quality, 0.0, 1.0)));
    attributes.body = bodyOf(signature.points);
    return attributes;
}

}  // namespace

Result<Signature> makeSignature(const Segmentation& segmentation, const SignatureOptions& options,
                                const RunContext& context) {
    RETURN_IF_ERROR(validate(options));
    try {
        auto signature = makeSignatureOrThrow(segmentation, options);
        if (!signature || !options.attributes) return signature;
        RETURN_IF_ERROR(context.checkpoint());
        auto attributes = attributesOf(segmentation, *signature, context);
        RETURN_IF_ERROR(attributes);
        signature->attributes = std::move(*attributes);
        return signature;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for a signature");
    }
}

}  // namespace shapedb
