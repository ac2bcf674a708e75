// SPDX-License-Identifier: GPL-3.0-or-later
// The baseline of `segment`: CGAL's triangulation of the same points and nothing else.
#pragma once

#include <cstddef>

#include "core/geometry/point.h"

namespace shapedb::bench {

struct BareDelaunay {
    double seconds = 0.0;  ///< of this thread, for the range insertion
    double wallSeconds = 0.0;
    std::size_t tetrahedra = 0;
};

/// CGAL::Delaunay_triangulation_3 over the kernel with exact predicates, range insertion straight from
/// `points`, one thread. Throws what CGAL throws.
[[nodiscard]] BareDelaunay bareDelaunay(const PointCloud& points);

/// The same with CGAL's parallel insertion and a lock grid over the unit frame.
[[nodiscard]] BareDelaunay bareParallelDelaunay(const PointCloud& points);

}  // namespace shapedb::bench
