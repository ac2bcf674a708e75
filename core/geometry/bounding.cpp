#include "core/geometry/bounding.h"

#include <cmath>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Min_sphere_of_points_d_traits_3.h>
#include <CGAL/Min_sphere_of_spheres_d.h>

namespace shapedb {

Result<double> smallestSphereDiameter(const PointCloud& points) {
    using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
    using Traits = CGAL::Min_sphere_of_points_d_traits_3<Kernel, double>;
    if (points.empty()) return fail(ErrorCode::kInvalidArgument, "no points to bound");
    try {
        std::vector<Kernel::Point_3> copies;
        copies.reserve(points.size());
        for (const Point3& p : points) copies.emplace_back(p.x, p.y, p.z);
        CGAL::Min_sphere_of_spheres_d<Traits> sphere(copies.begin(), copies.end());
        return 2.0 * sphere.radius();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to bound the points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("smallest sphere: ") + e.what());
    }
}

}  // namespace shapedb
