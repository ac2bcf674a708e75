// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/predicates.h"

#include <algorithm>
#include <array>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

namespace shapedb {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 toKernel(const Site& p) { return {p.x, p.y, p.z}; }

bool lexicographicLess(const Site* a, const Site* b) {
    if (a->x != b->x) return a->x < b->x;
    if (a->y != b->y) return a->y < b->y;
    return a->z < b->z;
}

int planeOrientation(const Site& a, const Site& b, const Site& c) {
    return CGAL::coplanar_orientation(toKernel(a), toKernel(b), toKernel(c));
}

}  // namespace

int exactOrientation(const Site& a, const Site& b, const Site& c, const Site& d) {
    return CGAL::orientation(toKernel(a), toKernel(b), toKernel(c), toKernel(d));
}

int exactSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d, const Site& p) {
    return CGAL::side_of_oriented_sphere(toKernel(a), toKernel(b), toKernel(c), toKernel(d), toKernel(p));
}

int sideOfCircle(const Site& a, const Site& b, const Site& c, const Site& p) {
    const int side =
        CGAL::coplanar_side_of_bounded_circle(toKernel(a), toKernel(b), toKernel(c), toKernel(p));
    if (side != 0) return side;
    // As perturbedSideOfSphere, one dimension lower.
    std::array<const Site*, 4> descending = {&a, &b, &c, &p};
    std::sort(descending.begin(), descending.end(),
              [](const Site* l, const Site* r) { return lexicographicLess(r, l); });
    const int whole = planeOrientation(a, b, c);
    for (std::size_t i = 0; i < 3; ++i) {
        if (descending[i] == &p) return -1;
        int part = 0;
        if (descending[i] == &c) part = planeOrientation(a, b, p);
        if (descending[i] == &b) part = planeOrientation(a, p, c);
        if (descending[i] == &a) part = planeOrientation(p, b, c);
        if (part != 0) return part * whole;
    }
    return -whole;
}

int perturbedSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d, const Site& p) {
    std::array<const Site*, 5> descending = {&a, &b, &c, &d, &p};
    std::sort(descending.begin(), descending.end(),
              [](const Site* l, const Site* r) { return lexicographicLess(r, l); });
    // The perturbation lifts the paraboloid above each point by its own power of an infinitesimal, the
    // largest for the lexicographically largest point. The sign of the determinant is then that of the first
    // monomial that does not vanish: the orientation of the other four points. One of the first two never
    // does.
    for (std::size_t i = 0; i < 2; ++i) {
        if (descending[i] == &p) return -1;  // of a, b, c and d, which are positively oriented
        int part = 0;
        if (descending[i] == &d) part = orientation(a, b, c, p);
        if (descending[i] == &c) part = orientation(a, b, p, d);
        if (descending[i] == &b) part = orientation(a, p, c, d);
        if (descending[i] == &a) part = orientation(p, b, c, d);
        if (part != 0) return part;
    }
    return -1;
}

}  // namespace shapedb
