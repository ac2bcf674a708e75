// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/bare_delaunay.h"

#include <chrono>

#define CGAL_LINKED_WITH_TBB
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <boost/iterator/transform_iterator.hpp>

#include "bench/measuring.h"

namespace shapedb::bench {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

struct ToKernel {
    Kernel::Point_3 operator()(const Point3& p) const { return {p.x, p.y, p.z}; }
};

template <typename Triangulation>
BareDelaunay insertAll(Triangulation& triangulation, const PointCloud& points) {
    const auto start = std::chrono::steady_clock::now();
    const ThreadStopwatch stopwatch;
    triangulation.insert(boost::make_transform_iterator(points.begin(), ToKernel()),
                         boost::make_transform_iterator(points.end(), ToKernel()));
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    return {stopwatch.seconds(), wall.count(), triangulation.number_of_finite_cells()};
}

}  // namespace

BareDelaunay bareDelaunay(const PointCloud& points) {
    CGAL::Delaunay_triangulation_3<Kernel> triangulation;
    return insertAll(triangulation, points);
}

BareDelaunay bareParallelDelaunay(const PointCloud& points) {
    using Structure = CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_3<Kernel>,
                                                           CGAL::Delaunay_triangulation_cell_base_3<Kernel>,
                                                           CGAL::Parallel_tag>;
    using Triangulation = CGAL::Delaunay_triangulation_3<Kernel, Structure>;
    constexpr int kLocksPerAxis = 50;  // as CGAL's manual suggests
    Triangulation::Lock_data_structure locks(CGAL::Bbox_3(-1.0, -1.0, -1.0, 1.0, 1.0, 1.0), kLocksPerAxis);
    Triangulation triangulation(&locks);
    return insertAll(triangulation, points);
}

}  // namespace shapedb::bench
