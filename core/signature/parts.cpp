#include "core/signature/parts.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "core/signature/signature.h"

namespace shapedb {

namespace {

Eigen::Matrix3d covarianceOf(const SignaturePoint& point) {
    const auto& c = point.covariance;
    Eigen::Matrix3d m;
    m << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    return m;
}

float logLength(double length) { return static_cast<float>(std::log2(std::max(length, kSmallestLength))); }

Point3 positionOf(const SignaturePoint& point) {
    return {point.position[0], point.position[1], point.position[2]};
}

void setFrame(const std::vector<SignaturePoint>& points, Body& body) {
    double total = 0.0;
    for (const SignaturePoint& p : points) total += p.weight;
    for (const SignaturePoint& p : points) {
        body.centre = body.centre + (p.weight / total) * positionOf(p);
    }
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const SignaturePoint& p : points) {
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

Part partOf(const SignaturePoint& point, const Body& body) {
    Part part;
    const Point3 p = rotate(body.axes, positionOf(point) - body.centre);
    part.position = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    part.radius = static_cast<float>(length(p));
    part.share = point.volumeShare;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covarianceOf(point), Eigen::EigenvaluesOnly);
    for (int axis = 0; axis < 3; ++axis) {
        part.size[static_cast<std::size_t>(axis)] =
            logLength(std::sqrt(std::max(0.0, solver.eigenvalues()[2 - axis])));
    }
    // A flat tetrahedron may carry any radius: none larger than the shape means anything.
    part.size[3] = logLength(std::min(1.0, static_cast<double>(point.peakRadius)));
    return part;
}

}  // namespace

Body bodyOf(const std::vector<SignaturePoint>& points) {
    Body body;
    setFrame(points, body);
    body.parts.reserve(points.size());
    for (const SignaturePoint& point : points) body.parts.push_back(partOf(point, body));
    return body;
}

}  // namespace shapedb
