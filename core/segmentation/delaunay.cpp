#include "core/segmentation/delaunay.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <new>
#include <numeric>
#include <string>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include "core/segmentation/exact_geometry.h"

namespace shapedb {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<std::uint32_t, Kernel>;
using CellBase = CGAL::Triangulation_cell_base_with_info_3<std::uint32_t, Kernel,
                                                           CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Triangulation =
    CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

constexpr std::size_t kInsertsBetweenCheckpoints = 4096;

// A tetrahedron is computed exactly when its volume, as a share of the box spanned by its three
// edges at a corner, leaves fewer than about six correct digits in double precision.
constexpr double kFlatShare = 1e-10;

// The order in which points are inserted: along a Hilbert curve, so that each insertion
// starts next to the one before (what CGAL's range insert does, with room for checkpoints).
std::vector<std::size_t> insertionOrder(const std::vector<Kernel::Point_3>& points) {
    using Map = CGAL::Pointer_property_map<Kernel::Point_3>::const_type;
    using Traits = CGAL::Spatial_sort_traits_adapter_3<Kernel, Map>;
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    CGAL::spatial_sort(order.begin(), order.end(), Traits(CGAL::make_property_map(points)));
    return order;
}

Result<void> insertAll(Triangulation& triangulation, const PointCloud& cloud, const RunContext& context) {
    std::vector<Kernel::Point_3> points;
    points.reserve(cloud.size());
    for (const Point3& p : cloud) points.emplace_back(p.x, p.y, p.z);
    const std::vector<std::size_t> order = insertionOrder(points);
    Triangulation::Cell_handle hint;
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i % kInsertsBetweenCheckpoints == 0) {
            if (auto go = context.checkpoint(); !go) return go;
            context.report("delaunay", i, order.size());
        }
        const auto vertex = triangulation.insert(points[order[i]], hint);
        vertex->info() = static_cast<std::uint32_t>(order[i]);
        hint = vertex->cell();
    }
    return {};
}

Result<void> checkDimension(const Triangulation& triangulation, std::size_t given) {
    if (triangulation.number_of_vertices() != given) {
        return fail(ErrorCode::kInternal, "the points to triangulate are not distinct");
    }
    switch (triangulation.dimension()) {
        case 3: return {};
        case 2: return fail(ErrorCode::kCoplanar, "all points lie in one plane");
        case 1: return fail(ErrorCode::kCollinear, "all points lie on one line");
        default: return fail(ErrorCode::kTooFewPoints, "fewer than 4 distinct points");
    }
}

Point3 circumcentre(const TetrahedronCorners& p) {
    const Point3 a = p[1] - p[0];
    const Point3 b = p[2] - p[0];
    const Point3 c = p[3] - p[0];
    const Point3 bc = cross(b, c);
    const double aa = squaredLength(a);
    const double bb = squaredLength(b);
    const double cc = squaredLength(c);
    const double sixVolumes = dot(a, bc);
    if (!(sixVolumes > kFlatShare * std::sqrt(aa * bb * cc))) return exactCircumcentre(p);
    const Point3 numerator = aa * bc + bb * cross(c, a) + cc * cross(a, b);
    return p[0] + (0.5 / sixVolumes) * numerator;
}

Tetrahedra flatten(Triangulation& triangulation, const PointCloud& cloud) {
    Tetrahedra flat;
    const std::size_t count = triangulation.number_of_finite_cells();
    flat.vertices.reserve(count);
    flat.circumcentres.reserve(count);
    flat.circumradii.reserve(count);
    for (const auto cell : triangulation.all_cell_handles()) cell->info() = kNoTetrahedron;
    for (const auto cell : triangulation.finite_cell_handles()) {
        cell->info() = static_cast<std::uint32_t>(flat.vertices.size());
        std::array<std::uint32_t, 4> vertices;
        TetrahedronCorners corners;
        for (std::size_t i = 0; i < 4; ++i) {
            vertices[i] = cell->vertex(static_cast<int>(i))->info();
            corners[i] = cloud[vertices[i]];
        }
        const Point3 centre = circumcentre(corners);
        flat.vertices.push_back(vertices);
        flat.circumcentres.push_back(centre);
        flat.circumradii.push_back(distance(centre, corners[0]));
    }
    flat.neighbours.reserve(count);
    for (const auto cell : triangulation.finite_cell_handles()) {
        std::array<std::uint32_t, 4> neighbours;
        for (int i = 0; i < 4; ++i) neighbours[static_cast<std::size_t>(i)] = cell->neighbor(i)->info();
        flat.neighbours.push_back(neighbours);
    }
    return flat;
}

}  // namespace

Result<Tetrahedra> triangulate(const PointCloud& points, const RunContext& context) {
    if (points.size() < 4) return fail(ErrorCode::kTooFewPoints, "fewer than 4 distinct points");
    try {
        Triangulation triangulation;
        if (auto done = insertAll(triangulation, points, context); !done) return fail(done.error());
        if (auto solid = checkDimension(triangulation, points.size()); !solid) return fail(solid.error());
        return flatten(triangulation, points);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the Delaunay triangulation of " +
                                                 std::to_string(points.size()) + " points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("Delaunay triangulation: ") + e.what());
    }
}

}  // namespace shapedb
