// Parameters of the segmentation, one struct, with the values of the paper as defaults.
#pragma once

#include <cstdint>

#include "core/base/error.h"

namespace shapedb {

struct SegmentationOptions {
    /// A Delaunay ball is big when its radius exceeds this many times the point scale
    /// (mean distance to the three nearest other points) of one of its four points.
    /// Section 2, the paper's rho. Dimensionless, > 0. Larger: more noise is skipped, thin
    /// parts are lost.
    double bigBallRatio = 0.5;

    /// Two big balls intersect deeply when their spheres meet at an angle below this.
    /// Section 2 names the property but no figure. Degrees, in (0, 90). Larger: the outside
    /// eats further into the shape; smaller: the outside stops short and pockets count as inside.
    double deepAngleDegrees = 20.0;

    /// The walk enters through a hull facet when the ball behind it is so large that its
    /// sphere meets the facet's plane at an angle below this: nearly the half space beyond
    /// the hull. Degrees, in (0, 90).
    double hullAngleDegrees = 5.0;

    /// Two segments sharing a triangle merge when both peaks are at most this many
    /// circumradii of the triangle. Section 3.3. Dimensionless, >= 1.
    double mergeRatio = 1.5;

    /// Scans with more distinct points than this are first averaged onto a grid of about as
    /// many cells. 0: never (the paper).
    std::uint32_t decimateTo = 0;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const SegmentationOptions& options);

}  // namespace shapedb
