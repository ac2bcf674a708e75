// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

namespace shapedb {

namespace {

// Distances along the surface are forgiven up to this many spacings of its samples, and up to this many cells
// of the grid, within which the nearest sample may be missed.
constexpr float kForgivenSpacings = 1.0f;
constexpr float kForgivenCells = 0.75f;

float squaredForgiven(const FitPoints& points) {
    const float forgiven = std::max(kForgivenSpacings * points.spacing, kForgivenCells / points.grid.scale());
    return forgiven * forgiven;
}

// One-sided: pixels of the depth buffer are this many spacings wide, and what lies less than kDepthTolerance
// pixels behind the nearest point of its pixel is seen too.
constexpr float kPixelSpacings = 1.7f;
constexpr float kDepthTolerance = 1.0f;
constexpr int kMostPixels = 64;

// Where less of the other shape than this weight, in points, is left, it explains nothing.
constexpr float kLeastWeight = 4.0f;

constexpr double kDamping = 1e-4;

// Radians, pixels' sides: below these there is nothing to divide by.
constexpr double kNoTurn = 1e-12;
constexpr float kLeastPixel = 1e-6f;

float reduced(float width) { return 1.0f / (width * width); }

// The upper triangle of the normal equations, all seven unknowns.
struct System {
    Eigen::Matrix<double, 7, 7> matrix = Eigen::Matrix<double, 7, 7>::Zero();
    Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
};

System systemOf(const StepSums& sums) {
    System s;
    std::size_t at = 0;
    for (Eigen::Index i = 0; i < 7; ++i) {
        for (Eigen::Index j = i; j < 7; ++j) s.matrix(i, j) = s.matrix(j, i) = sums.plane[at++];
        s.right(i) = sums.plane[at++];
    }
    const auto& p = sums.point;
    const double w = p[0];
    const double squared = p[4] + p[7] + p[9];
    Eigen::Matrix3d spread;
    spread << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
    Eigen::Matrix3d crossed;  // of w y
    crossed << 0.0, -p[3], p[2], p[3], 0.0, -p[1], -p[2], p[1], 0.0;
    s.matrix.block<3, 3>(0, 0) += squared * Eigen::Matrix3d::Identity() - spread;
    s.matrix.block<3, 3>(0, 3) += crossed;
    s.matrix.block<3, 3>(3, 0) += crossed.transpose();
    s.matrix.block<3, 3>(3, 3) += w * Eigen::Matrix3d::Identity();
    for (Eigen::Index k = 0; k < 3; ++k) {
        const auto at1 = static_cast<std::size_t>(k + 1);
        s.matrix(3 + k, 6) += p[at1];
        s.matrix(6, 3 + k) += p[at1];
        s.right(k) += p[13 + static_cast<std::size_t>(k)];
        s.right(3 + k) += p[10 + static_cast<std::size_t>(k)];
    }
    s.matrix(6, 6) += squared;
    s.right(6) += p[16];
    return s;
}

// The rotation about `turn` by its length, in radians.
Matrix3 rotationBy(const Point3& turn) {
    const double angle = length(turn);
    if (!(angle > kNoTurn)) return Motion{}.rotation;
    return rotationAbout((1.0 / angle) * turn, angle);
}

// Rounding of many small turns must not make a rotation skew.
void straighten(Matrix3& r, bool reflected) {
    Point3 a{r[0][0], r[0][1], r[0][2]};
    Point3 b{r[1][0], r[1][1], r[1][2]};
    a = (1.0 / length(a)) * a;
    b = b - dot(a, b) * a;
    b = (1.0 / length(b)) * b;
    const Point3 c = (reflected ? -1.0 : 1.0) * cross(a, b);
    r = {{{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}}};
}

// The step that minimises the weighted squares, applied to the pose. False when there is none.
bool applyStep(const StepSums& sums, bool keepScale, Motion& pose) {
    System s = systemOf(sums);
    const double trace = s.matrix.trace();
    if (!(trace > 0.0) || !std::isfinite(trace)) return false;
    s.matrix.diagonal().array() += kDamping * trace / static_cast<double>(StepSums::kUnknowns);
    Eigen::Matrix<double, 7, 1> step = Eigen::Matrix<double, 7, 1>::Zero();
    if (keepScale) {
        step.head<6>() = s.matrix.topLeftCorner<6, 6>().ldlt().solve(-s.right.head<6>());
    } else {
        step = s.matrix.ldlt().solve(-s.right);
    }
    if (!step.allFinite()) return false;
    // Steps are small turns: a larger one is the sign of a pose that holds nowhere.
    constexpr double kLargestTurn = 0.5;
    constexpr double kLargestGrowth = 0.2;
    Point3 turn{step(0), step(1), step(2)};
    if (length(turn) > kLargestTurn) turn = (kLargestTurn / length(turn)) * turn;
    Motion change;
    change.rotation = rotationBy(turn);
    change.scale = std::exp(std::clamp(step(6), -kLargestGrowth, kLargestGrowth));
    change.translation = {step(3), step(4), step(5)};
    pose = compose(change, pose);
    straighten(pose.rotation, pose.reflected);
    return true;
}

}  // namespace

double Shares::score() const { return std::sqrt(query * other); }

Comparison::Comparison(const FitPoints& query, const FitPoints& other) : query_(query), other_(other) {
    for (auto* column : {&x_, &y_, &z_}) column->resize(query.size());
    for (auto* column : {&mx_, &my_, &mz_, &weights_}) column->resize(other.size());
    depth_.resize(static_cast<std::size_t>(kMostPixels) * kMostPixels);
}

Gauge Comparison::gaugeOfOther(const Motion& pose, float width) const {
    return {squaredForgiven(other_), static_cast<float>(pose.scale * pose.scale), reduced(width)};
}

Gauge Comparison::gaugeOfQuery(float width) const { return {squaredForgiven(query_), 1.0f, reduced(width)}; }

// Weights of the first points of the other shape, moved into mx_, my_, mz_: whether the query should have
// seen them. Null: all alike.
const float* Comparison::weighOther(const Motion& pose, const FitView& view, std::size_t count) {
    switch (view.kind) {
        case FitKind::kPiece:
            weighInside(query_.grid, query_.insideHull.data(), mx_.data(), my_.data(), mz_.data(), count,
                        weights_.data());
            return weights_.data();
        case FitKind::kOneSided: weighFront(pose, view, count); return weights_.data();
        case FitKind::kWhole: break;
    }
    return nullptr;
}

// A depth buffer across the view; each point that is seen counts by the cosine of its surface to the view, as
// it does in the scan.
void Comparison::weighFront(const Motion& pose, const FitView& view, std::size_t count) {
    const std::array<const float*, 3> moved = {mx_.data(), my_.data(), mz_.data()};
    const float* x = moved[(view.axis + 1) % 3];
    const float* y = moved[(view.axis + 2) % 3];
    const float* z = moved[view.axis];
    const float front = view.front;
    float lowX = x[0], highX = x[0], lowY = y[0], highY = y[0];
    for (std::size_t i = 1; i < count; ++i) {
        lowX = std::min(lowX, x[i]);
        highX = std::max(highX, x[i]);
        lowY = std::min(lowY, y[i]);
        highY = std::max(highY, y[i]);
    }
    float pixel = kPixelSpacings * other_.spacingOf(count) * static_cast<float>(pose.scale);
    pixel = std::max({pixel, (highX - lowX) / static_cast<float>(kMostPixels - 1),
                      (highY - lowY) / static_cast<float>(kMostPixels - 1), kLeastPixel});
    const float perPixel = 1.0f / pixel;
    const int columns = static_cast<int>((highX - lowX) * perPixel) + 1;
    const int rows = static_cast<int>((highY - lowY) * perPixel) + 1;
    std::fill_n(depth_.begin(), columns * rows, -INFINITY);
    const auto pixelOf = [&](std::size_t i) {
        const int column = static_cast<int>((x[i] - lowX) * perPixel);
        const int row = static_cast<int>((y[i] - lowY) * perPixel);
        const int pixelIndex = row * columns + column;
        return static_cast<std::size_t>(pixelIndex);
    };
    for (std::size_t i = 0; i < count; ++i) {
        float& depth = depth_[pixelOf(i)];
        depth = std::max(depth, front * z[i]);
    }
    const auto& along = pose.rotation[view.axis];
    const auto& normals = other_.columns;
    for (std::size_t i = 0; i < count; ++i) {
        const bool seen = front * z[i] > depth_[pixelOf(i)] - kDepthTolerance * pixel;
        const float cosine = static_cast<float>(along[0]) * normals.nx[i] +
                             static_cast<float>(along[1]) * normals.ny[i] +
                             static_cast<float>(along[2]) * normals.nz[i];
        weights_[i] = seen ? std::abs(cosine) : 0.0f;
    }
}

Shares Comparison::shares(const Motion& pose, const FitView& view, std::size_t points, float width) {
    const std::size_t queries = query_.prefix(points);
    const std::size_t others = other_.prefix(points);
    moveColumns(query_.columns, queries, Affine(inverse(pose)), x_.data(), y_.data(), z_.data());
    const WeightedSum query = explainedBy(other_.grid, x_.data(), y_.data(), z_.data(), nullptr, queries,
                                          gaugeOfOther(pose, width));
    moveColumns(other_.columns, others, Affine(pose), mx_.data(), my_.data(), mz_.data());
    const float* weights = weighOther(pose, view, others);
    const WeightedSum other =
        explainedBy(query_.grid, mx_.data(), my_.data(), mz_.data(), weights, others, gaugeOfQuery(width));
    Shares shares;
    shares.query = static_cast<double>(query.sum / query.weight);
    if (other.weight >= kLeastWeight) shares.other = static_cast<double>(other.sum / other.weight);
    return shares;
}

Motion Comparison::refined(Motion pose, const FitView& view, bool keepScale, std::size_t points, int steps,
                           float fromWidth, float toWidth) {
    const std::size_t queries = query_.prefix(points);
    const std::size_t others = other_.prefix(points);
    for (int step = 0; step < steps; ++step) {
        const float way = steps > 1 ? static_cast<float>(step) / static_cast<float>(steps - 1) : 1.0f;
        const float width = fromWidth * std::pow(toWidth / fromWidth, way);
        StepSums sums;
        const Affine forward(pose);
        Motion turnOnly = pose;
        turnOnly.scale = 1.0;
        turnOnly.translation = {};
        moveColumns(query_.columns, queries, Affine(inverse(pose)), x_.data(), y_.data(), z_.data());
        addPairsToOther(other_.grid, query_.columns, x_.data(), y_.data(), z_.data(), queries, forward,
                        Affine(turnOnly), gaugeOfOther(pose, width), 1.0f / static_cast<float>(queries),
                        sums);
        moveColumns(other_.columns, others, forward, mx_.data(), my_.data(), mz_.data());
        const float* weights = weighOther(pose, view, others);
        float total = static_cast<float>(others);
        if (weights != nullptr) {
            total = 0.0f;
            for (std::size_t i = 0; i < others; ++i) total += weights[i];
        }
        if (total >= kLeastWeight) {
            addPairsToQuery(query_.grid, mx_.data(), my_.data(), mz_.data(), weights, others,
                            gaugeOfQuery(width), 1.0f / total, sums);
        }
        if (!applyStep(sums, keepScale, pose)) break;
    }
    return pose;
}

double Comparison::residual(const Motion& pose, float within) {
    moveColumns(query_.columns, query_.size(), Affine(inverse(pose)), x_.data(), y_.data(), z_.data());
    const Gauge gauge = gaugeOfOther(pose, within);
    // In place of the places.
    squaredDistances(other_.grid, x_.data(), y_.data(), z_.data(), query_.size(), gauge, x_.data());
    double sum = 0.0;
    std::size_t near = 0;
    for (std::size_t i = 0; i < query_.size(); ++i) {
        if (x_[i] > within * within) continue;
        sum += static_cast<double>(x_[i]);
        ++near;
    }
    return near == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(near));
}

double Comparison::apart(const Motion& a, const Motion& b) const {
    Matrix3 d;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            d[i][j] = a.scale * a.rotation[i][j] - b.scale * b.rotation[i][j];
        }
    }
    double sum = squaredLength(rotate(d, other_.mean) + a.translation - b.translation);
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            for (std::size_t k = 0; k < 3; ++k) sum += d[i][j] * other_.covariance[j][k] * d[i][k];
        }
    }
    return std::sqrt(std::max(0.0, sum));
}

}  // namespace shapedb
