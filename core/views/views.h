// SPDX-License-Identifier: GPL-3.0-or-later
// Views of a shape: what a camera would see of it from twenty sides, so that a scan of one side can be
// compared with like. docs/views.md describes the method and what it finds.
#pragma once

#include <array>
#include <cstddef>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/surface_points.h"
#include "core/geometry/point.h"
#include "core/views/view_signature.h"

namespace shapedb {

/// Sides from which a shape is looked at: the corners of a dodecahedron along its principal axes.
constexpr std::size_t kViews = 20;

/// 1,360 bytes, whatever the shape. Equal values for equal shapes, in a fixed order.
struct ViewSet {
    std::array<ViewSignature, kViews> views;

    friend bool operator==(const ViewSet& a, const ViewSet& b) { return a.views == b.views; }
};

/// The views of a whole shape. `surface` must come from makeSurfacePoints or decodeSurfacePoints; `scan` are
/// the points it was made of (or a good part of them), which decide what hides what. Without them (an empty
/// cloud) the surface points decide: stored shapes can be given views without their scans, which find a
/// little less. Points of the scan must be finite.
///
/// Depends on nothing but its arguments, and not on the order of `scan`; a motion of the shape changes a
/// level by rounding alone, unless two of its principal axes are equally long. Runs on the calling thread.
///
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<ViewSet> makeViews(const SurfacePoints& surface, const PointCloud& scan,
                                        const RunContext& context = {});

/// The signature of a scan of one side. Of `surface` as above all points count: they were seen. Where the
/// viewer stood need not be known: `towards`, a direction from the scan to the viewer, only tells front from
/// back, and with the zero vector which is which is arbitrary (ViewQuery then compares both).
///
/// Errors: kOutOfMemory.
[[nodiscard]] Result<ViewSignature> makeViewOfScan(const SurfacePoints& surface, const Point3& towards = {});

/// The largest share of the surface points, 0 to 1, that can be seen from one side: one of the twenty, or an
/// end of the third principal axis. Near 1 for a scan of one side, and for a shape so flat that one side
/// shows it all; about a half for other wholes (docs/views.md).
///
/// Errors: kOutOfMemory.
[[nodiscard]] Result<double> seenShare(const SurfacePoints& surface);

}  // namespace shapedb
