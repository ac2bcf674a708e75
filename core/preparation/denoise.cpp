// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/denoise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <new>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/base/math.h"
#include "core/base/parallel.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr std::size_t kSamples = 500;
constexpr std::size_t kSamplesAtOnce = 16;  // of one thread
constexpr std::array<std::size_t, 10> kNeighbourhoods = {12, 16, 24, 32, 48, 64, 96, 128, 192, 256};

// The noise shows in how the spread of a neighbourhood across its plane grows with its size: while the
// neighbourhood is smaller than the layer of noise both grow together; then the spread stays at sigma;
// then it grows again, by curvature or because the far side of a thin part comes into view. Sigma is
// that plateau.

// A surface is as smooth as its sampling can tell when, in the smallest neighbourhood, the spread across
// the plane is below this share of the spread along it.
constexpr double kSmoothRatio = 0.2;

// Noise below this share of the spacing does not disturb Delaunay balls.
constexpr double kHarmlessRatio = 0.1;

// On a plateau the spread grows with less than this power of the neighbourhood's width.
constexpr double kPlateauSlope = 0.85;
// Slopes within the tolerance belong to one plateau; one that is steeper by kPlateauEnds ends it, since
// there the neighbourhoods have reached the far side of the part.
constexpr double kPlateauTolerance = 0.05;
constexpr double kPlateauEnds = 0.15;

// Kurtosis of the heights above the plane: 3 of noise, 1.8 of a filled layer, 1 of two sheets.
constexpr double kTwoSheetsKurtosis = 2.0;

constexpr double kReachInSpacings = 4.0;  // pi * 4^2: about fifty neighbours
// A point with fewer than this share of the neighbours to be expected within its reach lies off the
// surface; its reach is widened.
constexpr double kEnoughShare = 0.5;
constexpr double kWiderReach = 1.6;
constexpr std::size_t kQuadricMinimum = 12;
constexpr double kMaxMoveInSigmas = 3.0;

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Every n-th point by distance from the centroid: the choice does not depend on the pose.
std::vector<std::uint32_t> samplePoints(const PointCloud& points) {
    const std::vector<Neighbour> byDistance = byDistanceFromCentroid(points);
    const std::size_t count = std::min(points.size(), kSamples);
    std::vector<std::uint32_t> chosen(count);
    for (std::size_t i = 0; i < count; ++i) chosen[i] = byDistance[i * points.size() / count].point;
    return chosen;
}

// Spread of each sampled neighbourhood across and along its plane, by size of neighbourhood.
struct Spreads {
    std::array<std::vector<double>, kNeighbourhoods.size()> across;
    std::array<std::vector<double>, kNeighbourhoods.size()> along;
    std::size_t sizes = 0;  // how many of kNeighbourhoods the cloud is large enough for
    std::vector<std::uint32_t> sample;
    std::vector<std::uint32_t> near;  // the largest neighbourhood of each sampled point, nearest first

    std::size_t largest() const { return kNeighbourhoods[sizes - 1]; }
};

Eigen::Vector3d toEigen(const Point3& p) { return {p.x, p.y, p.z}; }

// Fills the entries of one neighbourhood, number `place` of the sample.
void measureSpread(const PointCloud& points, std::uint32_t centre, const std::vector<Neighbour>& found,
                   std::size_t place, Spreads& spreads) {
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    std::size_t next = 0;
    for (std::size_t s = 0; s < spreads.sizes; ++s) {
        // Nearest first, so each size adds to the sums of the one before.
        for (; next < kNeighbourhoods[s]; ++next) {
            const Eigen::Vector3d d = toEigen(points[found[next].point] - points[centre]);
            first += d;
            second += d * d.transpose();
        }
        const double n = static_cast<double>(next);
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
        solver.computeDirect(second / n - first * first.transpose() / (n * n), Eigen::EigenvaluesOnly);
        // The plane took three degrees of freedom.
        spreads.across[s][place] = std::sqrt(std::max(0.0, solver.eigenvalues()[0]) * n / (n - 3.0));
        spreads.along[s][place] = std::sqrt(std::max(0.0, solver.eigenvalues()[1]));
    }
}

Spreads measureSpreads(const PointCloud& points, const NeighbourIndex& index, std::size_t mostNeighbours) {
    Spreads spreads;
    while (spreads.sizes < kNeighbourhoods.size() && kNeighbourhoods[spreads.sizes] <= mostNeighbours) {
        ++spreads.sizes;
    }
    if (spreads.sizes == 0) return spreads;
    spreads.sample = samplePoints(points);
    spreads.near.resize(spreads.sample.size() * spreads.largest());
    for (std::size_t s = 0; s < spreads.sizes; ++s) {
        spreads.across[s].resize(spreads.sample.size());
        spreads.along[s].resize(spreads.sample.size());
    }
    const auto measure = [&](std::size_t from, std::size_t to) {
        std::vector<Neighbour> found;
        for (std::size_t i = from; i < to; ++i) {
            index.nearest(points[spreads.sample[i]], spreads.largest(), found);
            measureSpread(points, spreads.sample[i], found, i, spreads);
            std::uint32_t* near = spreads.near.data() + i * spreads.largest();
            for (const Neighbour& n : found) *near++ = n.point;
        }
    };
    // Nothing can stop it: there is no context.
    static_cast<void>(parallelFor(spreads.sample.size(), kSamplesAtOnce, {}, measure));
    return spreads;
}

// Kurtosis of the heights of points above the plane that fits them best.
double heightKurtosis(const PointCloud& points, const std::uint32_t* near, std::size_t count) {
    const auto place = [&](std::size_t k) { return toEigen(points[near[k]] - points[near[0]]); };
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < count; ++k) mean += place(k);
    mean /= static_cast<double>(count);
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < count; ++k) {
        const Eigen::Vector3d d = place(k) - mean;
        second += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(second);
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    double squares = 0.0;
    double fourths = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
        const double height = (place(k) - mean).dot(normal);
        squares += height * height;
        fourths += height * height * height * height;
    }
    return squares > 0.0 ? fourths * static_cast<double>(count) / (squares * squares) : 3.0;
}

// Whether neighbourhoods of `count` points have two layers.
bool haveTwoSheets(const PointCloud& points, const Spreads& spreads, std::size_t count) {
    std::vector<double> kurtosis(spreads.sample.size());
    const auto measure = [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
            kurtosis[i] = heightKurtosis(points, spreads.near.data() + i * spreads.largest(), count);
        }
    };
    // Nothing can stop it: there is no context.
    static_cast<void>(parallelFor(kurtosis.size(), kSamplesAtOnce, {}, measure));
    return median(std::move(kurtosis)) < kTwoSheetsKurtosis;
}

// A disc of radius r has a standard deviation of r / 2 along either axis.
double spacingFrom(double along, std::size_t neighbours) {
    return 2.0 * along * std::sqrt(kPi / static_cast<double>(neighbours));
}

// Principal frame of a neighbourhood.
struct LocalFrame {
    Eigen::Vector3d mean;
    Eigen::Matrix3d axes;  // columns, by rising spread: the first is the normal
};

// Below this share of the largest pivot, the neighbours do not determine a quadric: they lie along a line,
// say.
constexpr double kSmallestPivot = 1e-4;

// Height along the normal, above the origin (the point to be moved), of the fitted quadric; of the plane
// where there are too few neighbours for a quadric.
double heightOfFit(const std::vector<Eigen::Vector3d>& offsets, const std::vector<double>& weights,
                   const LocalFrame& frame, double reach) {
    const Eigen::Vector3d normal = frame.axes.col(0);
    const double planeHeight = frame.mean.dot(normal);
    if (offsets.size() < kQuadricMinimum) return planeHeight;
    Eigen::Matrix<double, 6, 6> normalMatrix = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (std::size_t i = 0; i < offsets.size(); ++i) {
        // In units of the reach, so that the pivots below can be compared.
        const double u = offsets[i].dot(frame.axes.col(1)) / reach;
        const double v = offsets[i].dot(frame.axes.col(2)) / reach;
        Eigen::Matrix<double, 6, 1> row;
        row << 1.0, u, v, u * u, u * v, v * v;
        normalMatrix += weights[i] * row * row.transpose();
        right += (weights[i] * offsets[i].dot(normal)) * row;
    }
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> factors(normalMatrix);
    const auto pivots = factors.vectorD();
    if (!(pivots.minCoeff() > kSmallestPivot * pivots.maxCoeff())) return planeHeight;
    return factors.solve(right)[0];
}

// Point `at` moved onto the surface fitted to its neighbours `found`, by at most `limit`.
Point3 projected(const PointCloud& points, std::uint32_t at, const std::vector<Neighbour>& found,
                 double reach, double limit, std::vector<Eigen::Vector3d>& offsets,
                 std::vector<double>& weights) {
    offsets.clear();
    weights.clear();
    double sum = 0.0;
    LocalFrame frame{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (const Neighbour& n : found) {
        const Eigen::Vector3d d = toEigen(points[n.point] - points[at]);
        // The weight is 0 at the reach, so it makes no difference whether a neighbour there is found.
        const double share = 1.0 - n.squaredDistance / (reach * reach);
        const double w = share * share;
        offsets.push_back(d);
        weights.push_back(w);
        sum += w;
        frame.mean += w * d;
        second += w * d * d.transpose();
    }
    if (found.size() < 4 || sum <= 0.0) return points[at];
    frame.mean /= sum;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(second / sum - frame.mean * frame.mean.transpose());
    frame.axes = solver.eigenvectors();
    // However bad the fit, no point moves farther than noise is likely to have moved it.
    const double height = std::clamp(heightOfFit(offsets, weights, frame, reach), -limit, limit);
    const Eigen::Vector3d move = height * frame.axes.col(0);
    return points[at] + Point3{move.x(), move.y(), move.z()};
}

// Points with fewer than `enough` neighbours get a wider reach.
Result<PointCloud> smoothOnce(const PointCloud& points, const NeighbourIndex& index, double reach,
                              double enough, double limit, const RunContext& context) {
    PointCloud moved(points.size());
    const auto moveOne = [&, found = std::vector<Neighbour>(), offsets = std::vector<Eigen::Vector3d>(),
                          weights = std::vector<double>()](std::uint32_t i) mutable {
        double own = reach;
        index.within(points[i], own, found);
        if (static_cast<double>(found.size()) < enough) {
            own *= kWiderReach;
            index.within(points[i], own, found);
        }
        moved[i] = projected(points, i, found, own, limit, offsets, weights);
    };
    RETURN_IF_ERROR(parallelForPoints(index.order(), context, moveOne));
    return moved;
}

}  // namespace

NoiseEstimate estimateNoise(const PointCloud& points, const NeighbourIndex& index,
                            std::size_t mostNeighbours) {
    const Spreads spreads = measureSpreads(points, index, std::min(mostNeighbours, points.size()));
    if (spreads.sizes == 0) return {};
    std::vector<double> across;
    std::vector<double> along;
    double flatness = 1.0;
    for (std::size_t s = 0; s < spreads.sizes; ++s) {
        across.push_back(median(spreads.across[s]));
        along.push_back(median(spreads.along[s]));
        if (along[s] > 0.0) flatness = std::min(flatness, across[s] / along[s]);
    }
    NoiseEstimate estimate{across[0], spacingFrom(along[0], kNeighbourhoods[0]), flatness, false};
    if (across[0] <= kSmoothRatio * along[0]) return estimate;
    double flattest = kPlateauSlope;
    std::size_t plateau = 0;
    for (std::size_t s = 1; s < spreads.sizes; ++s) {
        const double slope = std::log(across[s] / across[s - 1]) / std::log(along[s] / along[s - 1]);
        const bool found = flattest < kPlateauSlope;
        if (found && slope > flattest + kPlateauEnds) break;
        if (slope > flattest + (found ? kPlateauTolerance : 0.0)) continue;
        flattest = std::min(flattest, slope);
        plateau = s;
    }
    if (plateau == 0) return estimate;
    estimate.sigma = across[plateau];
    estimate.spacing = spacingFrom(along[plateau], kNeighbourhoods[plateau]);
    estimate.layered = haveTwoSheets(points, spreads, kNeighbourhoods[plateau]);
    return estimate;
}

Result<PointCloud> smooth(const PointCloud& points, const NeighbourIndex& index, const NoiseEstimate& noise,
                          double reachInSigmas, const RunContext& context) {
    try {
        if (!(noise.sigma > kHarmlessRatio * noise.spacing)) return points;
        const double reach = std::max(reachInSigmas * noise.sigma, kReachInSpacings * noise.spacing);
        const double expected = kPi * (reach / noise.spacing) * (reach / noise.spacing);
        return smoothOnce(points, index, reach, kEnoughShare * expected, kMaxMoveInSigmas * noise.sigma,
                          context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to smooth " + std::to_string(points.size()) + " points");
    }
}

}  // namespace shapedb
