// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/segment_descriptor.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "core/signature/covariance.h"
#include "core/signature/signature.h"

namespace shapedb {

namespace {

constexpr double kSmallestSize = -10.0;  // log2(kSmallestLength)
static_assert(kSmallestLength == 1.0 / 1024.0, "kSmallestSize is its logarithm");

// In steps of a stored share; allows for the float's rounding.
constexpr double kShareSlack = 0.01;

float logLength(double length) { return static_cast<float>(std::log2(std::max(length, kSmallestLength))); }

// Rounds halves away from zero, like std::lround, which is not inlined.
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
        moments += (p.weight / total) * (covarianceMatrix(p.covariance) + v * v.transpose());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    const Eigen::Vector3d u = solver.eigenvectors().col(2);
    const Eigen::Vector3d v = solver.eigenvectors().col(1);
    // Right-handed, whatever signs the solver chose.
    const Eigen::Vector3d w = u.cross(v);
    body.axes = {{{u[0], u[1], u[2]}, {v[0], v[1], v[2]}, {w[0], w[1], w[2]}}};
}

SegmentDescriptor descriptorOf(const WeightedPoint& point, const Body& body) {
    SegmentDescriptor segment;
    const Point3 p = rotate(body.axes, positionOf(point) - body.centre);
    segment.position = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    segment.share = point.volumeShare;
    // The closed form is fast (a starting server does this ten million times), and its eight digits are
    // plenty for steps of three per cent.
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(covarianceMatrix(point.covariance), Eigen::EigenvaluesOnly);
    for (int axis = 0; axis < 3; ++axis) {
        segment.size[static_cast<std::size_t>(axis)] =
            logLength(std::sqrt(std::max(0.0, solver.eigenvalues()[2 - axis])));
    }
    // The ball of a flat tetrahedron may have any radius; beyond the size of the shape it means nothing.
    segment.size[3] = logLength(std::min(1.0, static_cast<double>(point.maximumRadius)));
    // To the steps at once, so that a new signature scores as one from the index does.
    return unpacked(packed(segment));
}

}  // namespace

PackedSegmentDescriptor packed(const SegmentDescriptor& segment) noexcept {
    PackedSegmentDescriptor result;
    for (std::size_t i = 0; i < 3; ++i) {
        result.position[i] = nearest<std::int16_t>(segment.position[i] * kPositionSteps, -32767.0, 32767.0);
    }
    // Rounded down, so that shares do not add up to more than the whole.
    result.share =
        nearest<std::uint16_t>(std::floor(segment.share * kShareSteps + kShareSlack), 1.0, kShareSteps);
    for (std::size_t i = 0; i < 4; ++i) {
        result.size[i] = nearest<std::uint8_t>((segment.size[i] - kSmallestSize) * kSizeSteps, 0.0, 255.0);
    }
    return result;
}

SegmentDescriptor unpacked(const PackedSegmentDescriptor& segment) noexcept {
    SegmentDescriptor result;
    for (std::size_t i = 0; i < 3; ++i) {
        result.position[i] = static_cast<float>(segment.position[i] / kPositionSteps);
    }
    result.radius =
        static_cast<float>(length(Point3{result.position[0], result.position[1], result.position[2]}));
    result.share = static_cast<float>(segment.share / kShareSteps);
    for (std::size_t i = 0; i < 4; ++i) {
        result.size[i] = static_cast<float>(kSmallestSize + segment.size[i] / kSizeSteps);
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
    body.segments.clear();
    body.segments.reserve(points.size());
    for (const WeightedPoint& point : points) body.segments.push_back(descriptorOf(point, body));
}

}  // namespace shapedb
