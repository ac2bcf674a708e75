// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/motion.h"

#include <algorithm>
#include <cmath>

#include "core/base/math.h"

namespace shapedb {

namespace {

// Shorter draws are repeated: dividing by their length would magnify rounding.
constexpr double kShortestQuaternion = 1e-6;

}  // namespace

Matrix3 multiply(const Matrix3& a, const Matrix3& b) {
    Matrix3 product;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            double sum = 0.0;
            for (std::size_t k = 0; k < 3; ++k) sum += a[row][k] * b[k][column];
            product[row][column] = sum;
        }
    }
    return product;
}

Matrix3 transposed(const Matrix3& m) {
    return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

Matrix3 rotationAbout(const Point3& u, double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const double d = 1.0 - c;
    return {{{c + d * u.x * u.x, d * u.x * u.y - s * u.z, d * u.x * u.z + s * u.y},
             {d * u.x * u.y + s * u.z, c + d * u.y * u.y, d * u.y * u.z - s * u.x},
             {d * u.x * u.z - s * u.y, d * u.y * u.z + s * u.x, c + d * u.z * u.z}}};
}

Matrix3 rotationAboutAxis(std::size_t axis, double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const std::size_t j = (axis + 1) % 3;
    const std::size_t k = (axis + 2) % 3;
    Matrix3 r{};
    r[axis][axis] = 1.0;
    r[j][j] = c;
    r[j][k] = -s;
    r[k][j] = s;
    r[k][k] = c;
    return r;
}

double determinant(const Matrix3& m) {
    const Point3 a{m[0][0], m[0][1], m[0][2]};
    const Point3 b{m[1][0], m[1][1], m[1][2]};
    const Point3 c{m[2][0], m[2][1], m[2][2]};
    return dot(a, cross(b, c));
}

Point3 apply(const Motion& motion, const Point3& p) {
    return motion.scale * rotate(motion.rotation, p) + motion.translation;
}

PointCloud applyToCloud(const Motion& motion, const PointCloud& points) {
    PointCloud moved;
    moved.reserve(points.size());
    for (const Point3& p : points) moved.push_back(apply(motion, p));
    return moved;
}

Motion inverse(const Motion& motion) {
    Motion result;
    result.scale = 1.0 / motion.scale;
    result.reflected = motion.reflected;
    result.rotation = transposed(motion.rotation);
    result.translation = -result.scale * rotate(result.rotation, motion.translation);
    return result;
}

Motion compose(const Motion& second, const Motion& first) {
    Motion result;
    result.scale = second.scale * first.scale;
    result.reflected = second.reflected != first.reflected;
    result.rotation = multiply(second.rotation, first.rotation);
    result.translation = apply(second, first.translation);
    return result;
}

Matrix3 randomRotation(Random& random) {
    // Four independent normals have a direction uniform on the unit 3-sphere.
    double w = 0.0, x = 0.0, y = 0.0, z = 0.0, norm = 0.0;
    while (!(norm > kShortestQuaternion)) {
        w = random.normal();
        x = random.normal();
        y = random.normal();
        z = random.normal();
        norm = std::sqrt(w * w + x * x + y * y + z * z);
    }
    w /= norm;
    x /= norm;
    y /= norm;
    z /= norm;
    return {{{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
             {2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)},
             {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)}}};
}

Point3 evenDirection(int i, int count) {
    constexpr double kGoldenAngle = 2.399963229728653;
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double angle = kGoldenAngle * i;
    const double across = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {across * std::cos(angle), across * std::sin(angle), z};
}

Point3 anyPerpendicular(const Point3& direction) {
    // The coordinate axis it is least aligned with will do.
    const double x = std::abs(direction.x);
    const double y = std::abs(direction.y);
    const double z = std::abs(direction.z);
    const Point3 other = x <= y && x <= z ? Point3{1, 0, 0} : (y <= z ? Point3{0, 1, 0} : Point3{0, 0, 1});
    const Point3 across = cross(direction, other);
    return (1.0 / length(across)) * across;
}

Point3 randomDirection(Random& random) {
    // Archimedes: z is uniform over the sphere.
    const double z = random.uniform(-1.0, 1.0);
    const double angle = random.uniform(0.0, 2.0 * kPi);
    const double across = std::sqrt(1.0 - z * z);
    return {across * std::cos(angle), across * std::sin(angle), z};
}

}  // namespace shapedb
