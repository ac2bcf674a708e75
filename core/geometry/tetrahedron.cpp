// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/tetrahedron.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Simple_cartesian.h>

namespace shapedb {

namespace {

using Exact = CGAL::Simple_cartesian<CGAL::Exact_rational>;
using Filtered = CGAL::Exact_predicates_inexact_constructions_kernel;
using ExactPoint = Exact::Point_3;

std::array<ExactPoint, 4> toExact(const TetrahedronCorners& corners) {
    std::array<ExactPoint, 4> exact;
    for (std::size_t i = 0; i < 4; ++i) exact[i] = ExactPoint(corners[i].x, corners[i].y, corners[i].z);
    return exact;
}

}  // namespace

Point3 exactCircumcentre(const TetrahedronCorners& corners) {
    const auto p = toExact(corners);
    const ExactPoint centre = CGAL::circumcenter(p[0], p[1], p[2], p[3]);
    return {CGAL::to_double(centre.x()), CGAL::to_double(centre.y()), CGAL::to_double(centre.z())};
}

unsigned exactFlowMask(const TetrahedronCorners& corners) {
    std::array<Filtered::Point_3, 4> p;
    for (std::size_t i = 0; i < 4; ++i) p[i] = {corners[i].x, corners[i].y, corners[i].z};
    unsigned mask = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        // The centre lies beyond a facet exactly when the opposite corner lies inside the smallest sphere
        // through the facet's corners: a predicate that needs no centre.
        const auto side = CGAL::side_of_bounded_sphere(p[(i + 1) % 4], p[(i + 2) % 4], p[(i + 3) % 4], p[i]);
        if (side == CGAL::ON_BOUNDED_SIDE) mask |= 1u << i;
    }
    return mask;
}

}  // namespace shapedb
