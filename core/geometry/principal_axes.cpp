// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/principal_axes.h"

#include <Eigen/Eigenvalues>

namespace shapedb {

Matrix3 principalAxes(const PointCloud& points) {
    Point3 mean;
    for (const Point3& p : points) mean = mean + p;
    mean = (1.0 / static_cast<double>(points.size())) * mean;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Point3& p : points) {
        const Eigen::Vector3d d(p.x - mean.x, p.y - mean.y, p.z - mean.z);
        spread += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    const Eigen::Vector3d first = solver.eigenvectors().col(2);
    const Eigen::Vector3d second = solver.eigenvectors().col(1);
    const Eigen::Vector3d third = first.cross(second);
    return {{{first.x(), first.y(), first.z()},
             {second.x(), second.y(), second.z()},
             {third.x(), third.y(), third.z()}}};
}

}  // namespace shapedb
