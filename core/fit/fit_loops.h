// SPDX-License-Identifier: GPL-3.0-or-later
// The loops in which a fit spends its time: eight points at a time, compiled twice (for any processor, and
// for AVX2 where there is one), with the same bits. For the sources of this folder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/fit/nearest_grid.h"
#include "core/geometry/motion.h"

namespace shapedb {

/// m * p + t in single precision.
struct Affine {
    std::array<float, 9> m{};
    std::array<float, 3> t{};

    explicit Affine(const Motion& motion);
};

/// Moves the first `count` points (a multiple of eight) into x, y and z.
void moveColumns(const SurfaceColumns& points, std::size_t count, const Affine& motion, float* x, float* y,
                 float* z);

/// How far a place is from a surface known by samples: squared distance from the plane of the nearest sample,
/// and the squared distance within that plane as far as it exceeds `forgiven`; all times `unit`.
struct Gauge {
    float forgiven = 0.0f;   ///< squared, in units of the grid
    float unit = 1.0f;       ///< squared units of the grid to squared units of the result
    float overWidth = 1.0f;  ///< 1 / w^2: a distance d counts (1 + d^2 / w^2)^-2
};

struct WeightedSum {
    float sum = 0.0f;     ///< of weight times kernel
    float weight = 0.0f;  ///< of the weights
};

/// Over the places x, y, z in the frame of the grid. `weights`: null for 1.
[[nodiscard]] WeightedSum explainedBy(const NearestGrid& grid, const float* x, const float* y, const float* z,
                                      const float* weights, std::size_t count, const Gauge& gauge);

/// The squared distances that `explainedBy` counts. `out` may be x, y or z.
void squaredDistances(const NearestGrid& grid, const float* x, const float* y, const float* z,
                      std::size_t count, const Gauge& gauge, float* out);

/// The weight, 0 or 1, that a table gives to the cell of each place.
void weighInside(const NearestGrid& grid, const std::uint8_t* inside, const float* x, const float* y,
                 const float* z, std::size_t count, float* weights);

/// Sum of closeness over the places (x, y, z) + offset, given in cells. `count`: a multiple of eight.
[[nodiscard]] std::uint32_t closenessSum(const NearestGrid& grid, const float* x, const float* y,
                                         const float* z, std::size_t count,
                                         const std::array<float, 3>& offset);

/// Normal equations of a step of ICP. Unknown: turn (3), shift (3), growth (1) of the moved points about the
/// origin.
struct StepSums {
    static constexpr std::size_t kUnknowns = 7;
    static constexpr std::size_t kPlane = kUnknowns * (kUnknowns + 1) / 2 + kUnknowns;
    static constexpr std::size_t kPoint = 17;
    std::array<double, kPlane> plane{};  ///< upper triangle by rows, each row followed by its right-hand side
    /// For weight w, place y and difference e = y - target, the sums of: w, w y, w y y' (xx, xy, xz, yy, yz,
    /// zz), w e, w (y x e), w (y . e).
    std::array<double, kPoint> point{};
};

/// Adds the pairs of moved points of the other shape (x, y, z) and their nearest query points.
void addPairsToQuery(const NearestGrid& query, const float* x, const float* y, const float* z,
                     const float* weights, std::size_t count, const Gauge& gauge, float factor,
                     StepSums& sums);

/// Adds the pairs of query points and the points of the other shape nearest to them, moved. `places` are the
/// query points in the other's frame; `forward` moves the other's frame to the query's, `normals` its
/// normals.
void addPairsToOther(const NearestGrid& other, const SurfaceColumns& query, const float* x, const float* y,
                     const float* z, std::size_t count, const Affine& forward, const Affine& normals,
                     const Gauge& gauge, float factor, StepSums& sums);

}  // namespace shapedb
