// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/flat_delaunay.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <set>
#include <string>
#include <vector>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"
#include "core/delaunay/delaunay.h"
#include "core/delaunay/hilbert_order.h"
#include "core/preparation/sanitise.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corners = std::array<std::uint32_t, 4>;

// The reference: the tetrahedra of CGAL's triangulation, corners and tetrahedra sorted.
std::vector<Corners> byCgal(const PointCloud& points) {
    using Structure = CGAL::Triangulation_data_structure_3<
        CGAL::Triangulation_vertex_base_with_info_3<std::uint32_t, Kernel>,
        CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
    std::vector<std::pair<Kernel::Point_3, std::uint32_t>> numbered;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        numbered.emplace_back(Kernel::Point_3(points[i].x, points[i].y, points[i].z), i);
    }
    CGAL::Delaunay_triangulation_3<Kernel, Structure> triangulation;
    triangulation.insert(numbered.begin(), numbered.end());
    std::vector<Corners> tetrahedra;
    for (const auto cell : triangulation.finite_cell_handles()) {
        Corners corners;
        for (int i = 0; i < 4; ++i) corners[static_cast<std::size_t>(i)] = cell->vertex(i)->info();
        std::sort(corners.begin(), corners.end());
        tetrahedra.push_back(corners);
    }
    std::sort(tetrahedra.begin(), tetrahedra.end());
    return tetrahedra;
}

template <typename Vector>
std::vector<Corners> sorted(const Vector& unsorted) {
    std::vector<Corners> tetrahedra(unsorted.begin(), unsorted.end());
    for (Corners& corners : tetrahedra) std::sort(corners.begin(), corners.end());
    std::sort(tetrahedra.begin(), tetrahedra.end());
    return tetrahedra;
}

// From this many points on, threads share the work.
const std::size_t kShared = ParallelLimits{}.minPoints;

// Whether each neighbour has the facet's three corners, and this cell behind them.
bool hasMutualNeighbours(const CellStore& cells, std::uint32_t cell) {
    for (std::uint32_t i = 0; i < 4; ++i) {
        const Cell& next = cells[cells[cell].neighbours[i]];
        const Corners others = next.corners();
        std::uint32_t shared = 0;
        bool back = false;
        for (std::uint32_t k = 0; k < 4; ++k) {
            const Corners v = cells[cell].corners();
            if (std::find(v.begin(), v.end(), others[k]) != v.end()) {
                ++shared;
            } else {
                back = next.neighbours[k] == cell;
            }
        }
        if (shared != 3 || !back) return false;
    }
    return true;
}

// Straight from the store, with the points in the given order and exactly this many threads.
std::vector<Corners> byThreads(const PointCloud& points, std::size_t threads,
                               const ParallelLimits& limits = {}) {
    LargeVector<Site> sites;
    for (const Point3& p : points) sites.push_back({p.x, p.y, p.z});
    const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(static_cast<int>(threads));
    CellStore cells;
    std::vector<Corners> tetrahedra;
    const auto done = arena.execute([&] { return buildTriangulation(sites, cells, threads, {}, limits); });
    EXPECT_TRUE(done) << done.error().message;
    if (!done) return tetrahedra;
    bool mutual = true;
    for (std::uint32_t c = 0; c < cells.used(); ++c) {
        if (cells[c].isFree()) continue;
        const Corners v = cells[c].corners();
        mutual = mutual && hasMutualNeighbours(cells, c);
        if (std::all_of(v.begin(), v.end(), [](std::uint32_t i) { return i < kInfinite; })) {
            tetrahedra.push_back(v);
        }
    }
    EXPECT_TRUE(mutual);
    return sorted(std::move(tetrahedra));
}

PointCloud sortedCloud(const PointCloud& points) { return HilbertSortedCloud(points).takePoints(); }

PointCloud scanned(const NamedShape& shape, std::size_t count, double noise) {
    PointCloud points = sampleBoundary(shape.solid, count, 3).value();
    EXPECT_TRUE(addGaussianNoise(points, noise, 3));
    return sanitise(points).value().points;
}

// A cubic grid: the corners of each cube are cospherical, each layer is coplanar.
PointCloud grid(int side, double step) {
    PointCloud points;
    for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
            for (int k = 0; k < side; ++k) points.push_back({i * step, j * step, k * step});
        }
    }
    return points;
}

// Points that differ in the last digit of a coordinate, and points on a line.
PointCloud nearlyRepeated(int count = 1500) {
    Random random(5);
    PointCloud points;
    for (int i = 0; i < count; ++i) {
        const Point3 p{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        points.push_back(p);
        points.push_back(p + Point3{kGrid, 0, 0});
        points.push_back(p + Point3{0, kGrid, kGrid});
        points.push_back({i * 0x1p-12, 0.25, 0.5});
    }
    return sanitise(points).value().points;
}

// The points of an integer grid on one sphere: cospherical, many of them coplanar.
PointCloud integerSphere(int squaredRadius) {
    PointCloud points;
    for (int x = -80; x <= 80; ++x) {
        for (int y = -80; y <= 80; ++y) {
            for (int z = -80; z <= 80; ++z) {
                if (x * x + y * y + z * z == squaredRadius) {
                    points.push_back({x / 128.0, y / 128.0, z / 128.0});
                }
            }
        }
    }
    return points;
}

PointCloud inACube(std::size_t count) {
    Random random(7);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
    }
    return points;
}

TEST(Triangulation, HasTheTetrahedraOfCgalInSmallClouds) {
    for (const SmallCloud& cloud : smallClouds()) {
        const auto flat = triangulate(cloud.points);
        ASSERT_TRUE(flat) << cloud.name;
        EXPECT_TRUE(sorted(flat->vertices) == byCgal(cloud.points)) << cloud.name;
    }
}

TEST(Triangulation, HasTheTetrahedraOfCgalInLargerClouds) {
    const std::vector<std::pair<std::string, PointCloud>> clouds = {
        {"uniform", inACube(8000)},
        {"noisy dumbbell", scanned(makeDumbbell(), 12000, 0.003)},
        {"clean box", scanned(makeBox(), 8000, 0.0)},
        {"clean jack", scanned(makeJack(), 12000, 0.0)},
        {"grid", grid(16, 0.0625)},
        {"grid of tenths", grid(14, 0.1)},
        {"nearly repeated", nearlyRepeated()},
        {"integer sphere", integerSphere(3509)},
    };
    for (const auto& [name, points] : clouds) {
        const auto flat = triangulate(points);
        ASSERT_TRUE(flat) << name;
        EXPECT_TRUE(sorted(flat->vertices) == byCgal(points)) << name;
    }
}

TEST(Triangulation, HasTheSameTetrahedraForAnyNumberOfThreads) {
    // The limits of a large triangulation, scaled to smaller clouds; below once as they are.
    ParallelLimits limits;
    limits.minPoints /= 4;
    limits.minPerThread /= 4;
    const std::size_t count = limits.minPoints;
    const std::vector<std::pair<std::string, PointCloud>> clouds = {
        {"uniform", sortedCloud(inACube(count))},
        {"noisy jack", sortedCloud(scanned(makeJack(), count + 500, 0.002))},
        {"clean box", sortedCloud(scanned(makeBox(), count + 500, 0.0))},
        {"grid", sortedCloud(grid(24, 0.03125))},
        // Numbers say nothing about where points lie.
        {"not in Hilbert order", inACube(count)},
    };
    for (const auto& [name, points] : clouds) {
        ASSERT_GE(points.size(), count) << name;
        const auto alone = byThreads(points, 1, limits);
        ASSERT_FALSE(alone.empty()) << name;
        for (const std::size_t threads : {2, 5})
            EXPECT_TRUE(byThreads(points, threads, limits) == alone) << name << threads;
    }
}

// So many borders that the points left along them go in parallel again.
TEST(Triangulation, HasTheSameTetrahedraWithManyBorders) {
    const PointCloud points = sortedCloud(inACube(3 * kShared));
    EXPECT_TRUE(byThreads(points, 7) == byThreads(points, 1));
}

// So few points for each thread that hardly a cell has one owner.
TEST(Triangulation, ThreadsWithFewPointsFindTheTetrahedraOfCgal) {
    std::vector<std::pair<std::string, PointCloud>> clouds = {
        {"uniform", sortedCloud(inACube(1500))},
        {"noisy dumbbell", sortedCloud(scanned(makeDumbbell(), 2000, 0.003))},
        {"clean box", sortedCloud(scanned(makeBox(), 1500, 0.0))},
        {"grid", sortedCloud(grid(10, 0.0625))},
        {"nearly repeated", sortedCloud(nearlyRepeated(500))},
        {"not in Hilbert order", inACube(1000)},
    };
    for (const SmallCloud& cloud : smallClouds()) clouds.emplace_back(cloud.name, sortedCloud(cloud.points));
    for (const auto& [name, points] : clouds) {
        const auto expected = byCgal(points);
        for (const std::size_t threads : {2, 3, 6}) {
            for (const std::size_t least : {1, 16, 128}) {
                const ParallelLimits fine{0, least};
                EXPECT_TRUE(byThreads(points, threads, fine) == expected)
                    << name << " " << threads << " " << least;
            }
        }
    }
}

TEST(Triangulation, HasTheSameBitsOnAnyNumberOfThreads) {
    const PointCloud points = scanned(makeDumbbell(), kShared + 500, 0.001);
    const auto in = [&](int threads) {
        tbb::task_arena arena(threads);
        return arena.execute([&] { return triangulate(points).value(); });
    };
    const Tetrahedra one = in(1);
    const Tetrahedra three = in(3);
    EXPECT_TRUE(one.vertices == three.vertices);
    EXPECT_TRUE(one.neighbours == three.neighbours);
    EXPECT_TRUE(one.circumcentres == three.circumcentres);
    EXPECT_TRUE(one.circumradii == three.circumradii);
}

TEST(Triangulation, ParallelInsertionStopsWhenCancelled) {
    const PointCloud points = sortedCloud(inACube(kShared));
    LargeVector<Site> sites;
    for (const Point3& p : points) sites.push_back({p.x, p.y, p.z});
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    context.progress = [&](const char*, std::uint64_t done, std::uint64_t) {
        if (done > points.size() / 2) cancel = true;
    };
    CellStore cells;
    EXPECT_EQ(buildTriangulation(sites, cells, 2, context).error().code, ErrorCode::kCancelled);
}

TEST(Triangulation, ParallelInsertionRefusesRepeatedPoints) {
    PointCloud points = inACube(kShared);
    points.push_back(points[4321]);
    LargeVector<Site> sites;
    for (const std::uint32_t i : hilbertOrder(points))
        sites.push_back({points[i].x, points[i].y, points[i].z});
    CellStore cells;
    EXPECT_EQ(buildTriangulation(sites, cells, 2, {}).error().code, ErrorCode::kInternal);
}

// Two skew lines: every two neighbours on one make a tetrahedron with every two neighbours on the other.
TEST(Triangulation, StoreGrowsWherePointsHaveManyTetrahedra) {
    PointCloud points;
    for (int i = 0; i < 120; ++i) {
        points.push_back({i * 0.0078125, 0.0, 0.0});
        points.push_back({0.0, i * 0.0078125 + 0.001, 1.0});
    }
    const auto flat = triangulate(points);
    ASSERT_TRUE(flat);
    EXPECT_GT(flat->size(), 10000U);
    EXPECT_TRUE(sorted(flat->vertices) == byCgal(points));
}

}  // namespace
}  // namespace shapedb
