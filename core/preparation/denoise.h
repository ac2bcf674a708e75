// SPDX-License-Identifier: GPL-3.0-or-later
// Estimating the noise of a scan, and moving its points back to their surface.
#pragma once

#include <cstddef>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Lengths in the points' unit.
struct NoiseEstimate {
    /// Standard deviation of the points about their surface. A value below 0.1 * spacing means that
    /// the scan is clean: it comes from curvature.
    double sigma = 0.0;
    /// Edge of the square of surface that holds one point, as it would be without the noise. On the
    /// low side: up to a third too small on clean scans.
    double spacing = 0.0;
    /// Spread of neighbourhoods across their plane over that along it, at the size where this is least: near
    /// 0 on a surface, 0.8 and more where points fill space, or where noise is as thick as the parts.
    double flatness = 0.0;
    /// What was taken for noise has two layers: the sides of walls about as thin as the sampling resolves.
    bool layered = false;
};

/// `mostNeighbours`: the largest neighbourhood to look at. It must not hold most of a separate body, whose
/// thickness would be taken for noise.
///
/// An average over the shape, not a bound; noise above about a quarter of a part's thickness cannot be
/// told from thickness. 0 with fewer than 16 points or so. The pose does not matter (up to rounding).
///
/// `index` must hold `points`.
[[nodiscard]] NoiseEstimate estimateNoise(const PointCloud& points, const NeighbourIndex& index,
                                          std::size_t mostNeighbours);

/// Moves each point along the local normal onto a quadric fitted to its neighbours (moving least
/// squares), by at most three sigma. Neighbourhoods reach `reachInSigmas` times the noise and hold
/// about fifty points or more. A clean scan comes back unchanged.
///
/// `index` must hold `points`. Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<PointCloud> smooth(const PointCloud& points, const NeighbourIndex& index,
                                        const NoiseEstimate& noise, double reachInSigmas,
                                        const RunContext& context = {});

}  // namespace shapedb
