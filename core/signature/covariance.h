// SPDX-License-Identifier: GPL-3.0-or-later
// Covariance matrices as segments and signatures keep them: xx, xy, xz, yy, yz, zz. For the sources of this
// folder.
#pragma once

#include <array>

#include <Eigen/Core>

namespace shapedb {

template <typename Number>
[[nodiscard]] Eigen::Matrix3d covarianceMatrix(const std::array<Number, 6>& c) {
    Eigen::Matrix3d matrix;
    matrix << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    return matrix;
}

}  // namespace shapedb
