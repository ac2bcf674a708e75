// SPDX-License-Identifier: GPL-3.0-or-later
// Options of the segmentation. The defaults are those of the paper.
#pragma once

#include <cstdint>

#include "core/base/error.h"
#include "core/preparation/prepare_points.h"
#include "core/segmentation/interior_kinds.h"

namespace shapedb {

struct SegmentationOptions {
    /// What is done to the points before.
    PreparationOptions preparation;

    /// A Delaunay ball is big when its radius exceeds this many times the local spacing (mean
    /// distance to the three nearest other points) of one of its four points. The rho of
    /// Section 2; > 0. Larger values skip more noise but lose thin parts.
    double bigBallRatio = 0.5;

    /// Two big balls intersect deeply when their spheres meet at an angle below this. Section 2
    /// names the property but no figure. Degrees, in (0, 90); for InteriorMethod::kWalk only. Too
    /// large, and the outside eats into the shape; too small, and pockets count as inside.
    double deepAngleDegrees = 20.0;

    /// The walk enters through a hull facet when the sphere behind it meets the facet's plane at
    /// an angle below this, being nearly the half space beyond the hull. Degrees, in (0, 90); for
    /// InteriorMethod::kWalk only.
    double hullAngleDegrees = 5.0;

    /// Two segments that share a triangle merge when both maxima are at most this many times its
    /// circumradius. Section 3.3; >= 1.
    double mergeRatio = 1.5;

    /// Segments merge up to this contrast instead (contrast_merging.h): the larger radius over the
    /// smallest of both radii and the saddle radius between them. >= 1, or 0: by mergeRatio, as in
    /// the paper. Larger values give fewer, larger segments.
    double mergeContrast = 0.0;

    /// With mergeContrast: segments below this share of all volume join the neighbour with the
    /// largest saddle radius. In [0, 1].
    double minSegmentShare = 0.004;

    /// With mergeContrast: so does the lightest segment while more than this touch another. 0: no
    /// limit.
    std::uint32_t maxSegments = 16;

    /// How the interior is distinguished from the outside.
    InteriorMethod interiorMethod = InteriorMethod::kWalk;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const SegmentationOptions& options);

}  // namespace shapedb
