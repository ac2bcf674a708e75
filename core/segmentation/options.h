// Parameters of the segmentation, one struct, with the values of the paper as defaults.
#pragma once

#include <cstdint>

#include "core/base/error.h"
#include "core/preparation/options.h"
#include "core/segmentation/interior_kinds.h"

namespace shapedb {

struct SegmentationOptions {
    /// What is done to the points first.
    PreparationOptions preparation;

    /// A Delaunay ball is big when its radius exceeds this many times the point scale
    /// (mean distance to the three nearest other points) of one of its four points.
    /// Section 2, the paper's rho. Dimensionless, > 0. Larger: more noise is skipped, thin
    /// parts are lost.
    double bigBallRatio = 0.5;

    /// For InteriorMethod::kWalk, as is hullAngleDegrees.
    /// Two big balls intersect deeply when their spheres meet at an angle below this.
    /// Section 2 names the property but no figure. Degrees, in (0, 90). Larger: the outside
    /// eats further into the shape; smaller: the outside stops short and pockets count as inside.
    double deepAngleDegrees = 20.0;

    /// The walk enters through a hull facet when the ball behind it is so large that its
    /// sphere meets the facet's plane at an angle below this: nearly the half space beyond
    /// the hull. Degrees, in (0, 90).
    double hullAngleDegrees = 5.0;

    /// Two segments sharing a triangle merge when both maxima are at most this many
    /// circumradii of the triangle. Section 3.3. Dimensionless, >= 1.
    double mergeRatio = 1.5;

    /// Above 0, segments merge by contrast instead (hierarchy.h): up to this ratio of the thicker
    /// segment's radius to the narrowest of both radii and the saddleRadius between them.
    /// Dimensionless, >= 1, or 0: by mergeRatio (the paper). Larger: fewer, larger segments.
    double mergeContrast = 0.0;

    /// With mergeContrast: a segment lighter than this share of all volume joins the neighbour
    /// with the widest saddleRadius. In [0, 1].
    double minSegmentShare = 0.004;

    /// With mergeContrast: so does the lightest while there are more segments than this that touch
    /// another. 0: no limit.
    std::uint32_t maxSegments = 16;

    /// How the interior is told from the outside.
    InteriorMethod interiorMethod = InteriorMethod::kWalk;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const SegmentationOptions& options);

}  // namespace shapedb
