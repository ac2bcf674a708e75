// SPDX-License-Identifier: GPL-3.0-or-later
// From a noisy point cloud to the segments of the shape's interior: Sections 2 and 3 of
// Dey and Goswami, "Shape Segmentation and Matching from Noisy Point Clouds" (2004).
// Runs the stages in order, each of which has a header: core/preparation/prepare_points.h,
// core/delaunay/delaunay.h, core/geometry/neighbours.h, interior.h or adaptive_interior.h, flow.h,
// segments.h, contrast_merging.h.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"
#include "core/preparation/prepare_points.h"
#include "core/segmentation/adaptive_interior.h"
#include "core/segmentation/options.h"

namespace shapedb {

/// The stable manifold of a maximum of the distance function, after merging.
struct Segment {
    double volume = 0.0;  ///< of its tetrahedra, scan units cubed, > 0
    Point3 centroid;      ///< volume-weighted mean of the tetrahedra's centroids (Section 4.1)
    /// Circumradius of the largest Delaunay ball, scan units; at most the radius of a ball with the volume of
    /// the whole shape.
    double maximumRadius = 0.0;
    Point3 maximum;  ///< centre of that ball; the centroid where the ball was too large
    /// Second central moments of its matter per volume: xx, xy, xz, yy, yz, zz, scan units squared.
    std::array<double, 6> covariance{};
};

struct StageTime {
    const char* stage = "";  ///< static storage: "sanitise", "decimate", "delaunay", ...
    double seconds = 0.0;
};

struct Segmentation {
    /// In descending order of volume; equal volumes by centroid. Never empty.
    std::vector<Segment> segments;

    /// For each input point the index of its segment, -1 when it touches none: that of the inner
    /// tetrahedron at the point with the largest ball.
    std::vector<std::int32_t> pointSegment;

    /// For each tetrahedron the index of its segment, -1 outside.
    std::vector<std::int32_t> tetrahedronSegment;

    /// The triangulation, over `sites`.
    Tetrahedra tetrahedra;

    /// The points that were triangulated, scan units: distinct, prepared according to the options.
    /// `siteOfPoint` maps each input point to its site, kNoSite for an outlier.
    PointCloud sites;
    std::vector<std::uint32_t> siteOfPoint;

    double volume = 0.0;  ///< of all segments together, scan units cubed
    /// Smallest diagonal of an oriented box around the interior's tetrahedra, scan units. Points
    /// that no interior tetrahedron touches do not count.
    double size = 0.0;
    InteriorSource interiorSource = InteriorSource::kWalk;
    double quality = 1.0;                        ///< how far the interior can be trusted, [0, 1]; kWalk: 1
    InteriorDoubt doubt = InteriorDoubt::kNone;  ///< kAdaptive only, if noise was measured
    double angleDegrees = 0.0;                   ///< deep angle of the walk; 0 for other sources
    double noise = 0.0;  ///< estimated standard deviation before smoothing, scan units; 0: not measured

    std::uint64_t duplicates = 0;       ///< input points that repeated another; see PreparedPoints
    std::uint64_t outliers = 0;         ///< input points left out
    std::uint64_t outlierClusters = 0;  ///< separate groups of points among them; see PreparedPoints
    std::uint64_t bigBalls = 0;
    std::uint64_t interiorTetrahedra = 0;
    std::uint64_t maxima = 0;  ///< segments before merging

    std::vector<StageTime> stages;  ///< in the order they ran
    double delaunaySeconds = 0.0;
    double totalSeconds = 0.0;
};

/// Segments the interior of the shape the points were sampled from.
///
/// Deterministic: the same points in any order give the same segments, bit for bit.
/// Thread-safe (no shared state). Memory: about 600 bytes per distinct point at the peak.
///
/// Errors: those of `preparePoints` and `triangulate`; kInvalidArgument (options); kNoInterior
/// when the walk from outside reaches every big ball (an open surface or too much noise; with
/// InteriorMethod::kAdaptive only when even a layer around the points has no volume);
/// kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<Segmentation> segment(const PointCloud& points, const SegmentationOptions& options,
                                           const RunContext& context = {});

}  // namespace shapedb
