#include "core/delaunay/predicates.h"

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
    std::array<const Site*, 4> falling = {&a, &b, &c, &p};
    std::sort(falling.begin(), falling.end(),
              [](const Site* l, const Site* r) { return lexicographicLess(r, l); });
    const int whole = planeOrientation(a, b, c);
    for (std::size_t i = 0; i < 3; ++i) {
        if (falling[i] == &p) return -1;
        int part = 0;
        if (falling[i] == &c) part = planeOrientation(a, b, p);
        if (falling[i] == &b) part = planeOrientation(a, p, c);
        if (falling[i] == &a) part = planeOrientation(p, b, c);
        if (part != 0) return part * whole;
    }
    return -whole;
}

int perturbedSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d, const Site& p) {
    std::array<const Site*, 5> falling = {&a, &b, &c, &d, &p};
    std::sort(falling.begin(), falling.end(),
              [](const Site* l, const Site* r) { return lexicographicLess(r, l); });
    // The leading monomials of the perturbed determinant: one of the first two does not vanish.
    for (std::size_t i = 0; i < 2; ++i) {
        if (falling[i] == &p) return -1;  // a, b, c and d are positively oriented
        int part = 0;
        if (falling[i] == &d) part = orientation(a, b, c, p);
        if (falling[i] == &c) part = orientation(a, b, p, d);
        if (falling[i] == &b) part = orientation(a, p, c, d);
        if (falling[i] == &a) part = orientation(p, b, c, d);
        if (part != 0) return part;
    }
    return -1;
}

}  // namespace shapedb
