#include "core/signature/segment_descriptor.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "core/signature/signature.h"

namespace shapedb {

namespace {

Eigen::Matrix3d covarianceOf(const WeightedPoint& point) {
    const auto& c = point.covariance;
    Eigen::Matrix3d m;
    m << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    return m;
}

constexpr double kSmallestSize = -10.0;  // log2(kSmallestLength)
static_assert(kSmallestLength == 1.0 / 1024.0, "kSmallestSize is its logarithm");

float logLength(double length) { return static_cast<float>(std::log2(std::max(length, kSmallestLength))); }

// To the nearest integer, halves away from zero, as std::lround, which is a call.
template <typename Integer>
Integer nearest(double value, double low, double high) {
    const double clamped = std::clamp(value, low, high);
    const auto whole = static_cast<std::int32_t>(clamped);
    const double rest = clamped - whole;  // exact
    return static_cast<Integer>(whole + static_cast<int>(rest >= 0.5) - static_cast<int>(rest <= -0.5));
}

Point3 positionOf(const WeightedPoint& point) {
    return {point.position[0], point.position[1], point.position[2]};
}

void setFrame(const std::vector<WeightedPoint>& points, Body& body) {
    double total = 0.0;
    for (const WeightedPoint& p : points) total += p.weight;
    body.centre = {};
    for (const WeightedPoint& p : points) {
        body.centre = body.centre + (p.weight / total) * positionOf(p);
    }
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const WeightedPoint& p : points) {
        const Point3 d = positionOf(p) - body.centre;
        const Eigen::Vector3d v(d.x, d.y, d.z);
        moments += (p.weight / total) * (covarianceOf(p) + v * v.transpose());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    const Eigen::Vector3d u = solver.eigenvectors().col(2);
    const Eigen::Vector3d v = solver.eigenvectors().col(1);
    const Eigen::Vector3d w = u.cross(v);
    body.axes = {{{u[0], u[1], u[2]}, {v[0], v[1], v[2]}, {w[0], w[1], w[2]}}};
}

SegmentDescriptor partOf(const WeightedPoint& point, const Body& body) {
    SegmentDescriptor part;
    const Point3 p = rotate(body.axes, positionOf(point) - body.centre);
    part.position = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    part.share = point.volumeShare;
    // In closed form: eight digits are enough for steps of three percent, and a server that starts
    // does this ten million times.
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(covarianceOf(point), Eigen::EigenvaluesOnly);
    for (int axis = 0; axis < 3; ++axis) {
        part.size[static_cast<std::size_t>(axis)] =
            logLength(std::sqrt(std::max(0.0, solver.eigenvalues()[2 - axis])));
    }
    // A flat tetrahedron may carry any radius: none larger than the shape means anything.
    part.size[3] = logLength(std::min(1.0, static_cast<double>(point.maximumRadius)));
    return unpacked(packed(part));
}

}  // namespace

PackedSegmentDescriptor packed(const SegmentDescriptor& part) noexcept {
    PackedSegmentDescriptor result;
    for (std::size_t i = 0; i < 3; ++i) {
        result.position[i] = nearest<std::int16_t>(part.position[i] * kPositionSteps, -32767.0, 32767.0);
    }
    // Rounded down, so that the shares of a whole do not add up to more; a little room for the float.
    result.share = nearest<std::uint16_t>(std::floor(part.share * kShareSteps + 0.01), 1.0, kShareSteps);
    for (std::size_t i = 0; i < 4; ++i) {
        result.size[i] = nearest<std::uint8_t>((part.size[i] - kSmallestSize) * kSizeSteps, 0.0, 255.0);
    }
    return result;
}

SegmentDescriptor unpacked(const PackedSegmentDescriptor& part) noexcept {
    SegmentDescriptor result;
    for (std::size_t i = 0; i < 3; ++i) {
        result.position[i] = static_cast<float>(part.position[i] / kPositionSteps);
    }
    result.radius =
        static_cast<float>(length(Point3{result.position[0], result.position[1], result.position[2]}));
    result.share = static_cast<float>(part.share / kShareSteps);
    for (std::size_t i = 0; i < 4; ++i) {
        result.size[i] = static_cast<float>(kSmallestSize + part.size[i] / kSizeSteps);
    }
    return result;
}

bool operator==(const PackedSegmentDescriptor& a, const PackedSegmentDescriptor& b) noexcept {
    return a.position == b.position && a.share == b.share && a.size == b.size;
}

bool operator==(const SegmentDescriptor& a, const SegmentDescriptor& b) noexcept {
    return a.position == b.position && a.share == b.share && a.size == b.size;
}

Body bodyOf(const std::vector<WeightedPoint>& points) {
    Body body;
    setBody(points, body);
    return body;
}

void setBody(const std::vector<WeightedPoint>& points, Body& body) {
    setFrame(points, body);
    body.parts.clear();
    body.parts.reserve(points.size());
    for (const WeightedPoint& point : points) body.parts.push_back(partOf(point, body));
}

}  // namespace shapedb
