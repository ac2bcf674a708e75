// Parameters of the segmentation, one struct, with the values of the paper as defaults.
#pragma once

#include <cstdint>

#include "core/base/error.h"

namespace shapedb {

/// How inner big balls are told from outer ones.
enum class InteriorMethod : int {
    kWalk = 0,      ///< the walk of Section 2 with one fixed angle; nothing left inside is an error
    kAdaptive = 1,  ///< decided from the shape itself; always an interior, with a quality figure
};

struct SegmentationOptions {
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

    /// Two segments sharing a triangle merge when both peaks are at most this many
    /// circumradii of the triangle. Section 3.3. Dimensionless, >= 1.
    double mergeRatio = 1.5;

    /// Above 0, segments merge by contrast instead (hierarchy.h): up to this ratio of the thicker
    /// segment's radius to the narrowest of both radii and the passage between them.
    /// Dimensionless, >= 1, or 0: by mergeRatio (the paper). Larger: fewer, larger segments.
    double mergeContrast = 0.0;

    /// With mergeContrast: a segment lighter than this share of all volume joins the neighbour
    /// with the widest passage. In [0, 1].
    double minSegmentShare = 0.004;

    /// With mergeContrast: so does the lightest while there are more segments than this that touch
    /// another. 0: no limit.
    std::uint32_t maxSegments = 16;

    /// Scans with more distinct points than this are first averaged onto a grid of about as
    /// many cells. 0: never (the paper).
    std::uint32_t decimateTo = 0;

    /// A point is a stray, and left out, when its distance to its eighth neighbour exceeds this
    /// many times the mean of the same distance at those neighbours. Dimensionless, > 1, or 0:
    /// every point counts (the paper).
    double strayRatio = 0.0;

    /// Noisy points are moved onto a surface fitted to their neighbours out to this many standard
    /// deviations of the estimated noise. In [1, 20], or 0: points stay where they are (the
    /// paper). Smaller: noise remains; larger: thin parts shrink.
    double smoothingReach = 0.0;

    /// After that the points are thinned evenly, to no less than this many times the distance that
    /// sampling and noise allow to tell points apart. In (0, 10], or 0: all stay (the paper).
    double evenSpacing = 0.0;

    /// How the interior is told from the outside.
    InteriorMethod interiorMethod = InteriorMethod::kWalk;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const SegmentationOptions& options);

}  // namespace shapedb
