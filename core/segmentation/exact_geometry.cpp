#include "core/segmentation/exact_geometry.h"

#include <CGAL/Exact_rational.h>
#include <CGAL/Simple_cartesian.h>

namespace shapedb {

namespace {

using Exact = CGAL::Simple_cartesian<CGAL::Exact_rational>;
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
    const auto p = toExact(corners);
    const ExactPoint centre = CGAL::circumcenter(p[0], p[1], p[2], p[3]);
    unsigned mask = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        // The centre in place of corner i: the orientation turns negative beyond the facet.
        auto moved = p;
        moved[i] = centre;
        if (CGAL::orientation(moved[0], moved[1], moved[2], moved[3]) == CGAL::NEGATIVE) mask |= 1u << i;
    }
    return mask;
}

}  // namespace shapedb
