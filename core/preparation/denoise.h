// How noisy a scan is, and moving its points back to the surface they were sampled from.
#pragma once

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Lengths in the points' unit.
struct NoiseEstimate {
    /// Standard deviation of the points about their surface. Below 0.1 * spacing where the
    /// surface looks smooth at the scale of its sampling: then what is left is curvature.
    double sigma = 0.0;
    /// Edge of the square of surface that holds one point: the density of the sampling as it
    /// would look without the noise. On the low side: up to a third too small on clean scans.
    double spacing = 0.0;
};

/// Estimates the noise from the points alone. Around a sample of them the spread across the local
/// plane is measured for growing neighbourhoods: it grows with the neighbourhood while that is
/// smaller than the layer of noise, stays at sigma beyond, and grows again with the curvature or
/// where it meets the far side of a thin part. The plateau is sigma.
///
/// The same points in any pose give the same estimate up to rounding. Needs at least 16 points;
/// with fewer the estimate is 0. Noise above about a quarter of a part's thickness cannot be told
/// from thickness: the estimate is an average over the shape, not a bound.
[[nodiscard]] NoiseEstimate estimateNoise(const PointCloud& points, const NeighbourIndex& index);

/// Each point moved along the local normal onto a quadric fitted to its neighbours (moving least
/// squares, weights falling with distance). The neighbourhoods reach `reachInSigmas` times the noise
/// and hold at least about fifty points. No point moves farther than three sigma.
/// Points with noise below a share of the spacing come back unchanged.
///
/// `index` must hold `points`. Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<PointCloud> smooth(const PointCloud& points, const NeighbourIndex& index,
                                        const NoiseEstimate& noise, double reachInSigmas,
                                        const RunContext& context = {});

}  // namespace shapedb
