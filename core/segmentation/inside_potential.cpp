// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/inside_potential.h"

#include <cmath>

#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"
#include "core/segmentation/bottleneck_angle.h"

namespace shapedb {

namespace {

// How fast a bond weakens: between adjacent balls with the angle at which they meet, between poles as they
// leave the straight line through the point. A factor of two in either hardly changes the result.
constexpr double kBondDecay = 6.0;
constexpr double kPoleDecay = 4.0;

// Keeps tetrahedra without bonds (all underflow) from making the system singular.
constexpr double kAnchor = 1e-9;

constexpr int kMaxIterations = 400;
constexpr double kResidual = 1e-4;
constexpr int kIterationsBetweenCheckpoints = 16;

// A symmetric matrix in compressed rows. The outside is known, so its bonds are on the right-hand side.
struct System {
    std::vector<std::uint32_t> begin;
    std::vector<std::uint32_t> column;
    std::vector<double> value;
    std::vector<double> diagonal;
    std::vector<double> right;
};

struct Bond {
    std::uint32_t a = 0;
    std::uint32_t b = kNoTetrahedron;  // kNoTetrahedron: the outside
    double strength = 0.0;             // negative: pulls towards opposite signs
};

std::vector<Bond> collectBonds(const PointCloud& points, const Tetrahedra& tetrahedra,
                               const std::vector<Poles>& poles) {
    std::vector<Bond> bonds;
    bonds.reserve(2 * tetrahedra.size() + points.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            // Each facet once, from the tetrahedron with the lower index.
            if (next != kNoTetrahedron && next < t) continue;
            const double cosine = facetCosine(points, tetrahedra, t, facet);
            bonds.push_back({t, next, std::exp(kBondDecay * (cosine - 1.0))});
        }
    }
    for (const Poles& pole : poles) {
        if (pole.second == kNoTetrahedron) continue;
        bonds.push_back({pole.second, pole.first, -std::exp(kPoleDecay * (-pole.cosine - 1.0))});
    }
    return bonds;
}

// The quadratic form of Kolluri and others is the sum of |s| (x_a - sign(s) x_b)^2 over all bonds of strength
// s. With the outside held fixed, its minimum solves a linear system instead of an eigenvalue problem: |s|
// goes to the diagonal and -s beside it. The matrix is symmetric and diagonally dominant and, with the
// anchor, positive definite, as conjugate gradients require.
System assemble(std::size_t unknowns, const std::vector<Bond>& bonds) {
    System system;
    system.begin.assign(unknowns + 1, 0);
    system.diagonal.assign(unknowns, kAnchor);
    system.right.assign(unknowns, 0.0);
    for (const Bond& bond : bonds) {
        system.diagonal[bond.a] += std::abs(bond.strength);
        if (bond.b == kNoTetrahedron) {
            system.right[bond.a] += bond.strength;  // times the potential outside, 1
            continue;
        }
        system.diagonal[bond.b] += std::abs(bond.strength);
        ++system.begin[bond.a + 1];
        ++system.begin[bond.b + 1];
    }
    for (std::size_t i = 0; i < unknowns; ++i) system.begin[i + 1] += system.begin[i];
    system.column.resize(system.begin.back());
    system.value.resize(system.begin.back());
    std::vector<std::uint32_t> next(system.begin.begin(), system.begin.end() - 1);
    for (const Bond& bond : bonds) {
        if (bond.b == kNoTetrahedron) continue;
        system.column[next[bond.a]] = bond.b;
        system.value[next[bond.a]++] = -bond.strength;
        system.column[next[bond.b]] = bond.a;
        system.value[next[bond.b]++] = -bond.strength;
    }
    return system;
}

void multiply(const System& system, const std::vector<double>& x, std::vector<double>& y) {
    for (std::size_t i = 0; i < x.size(); ++i) {
        double sum = system.diagonal[i] * x[i];
        for (std::uint32_t k = system.begin[i]; k < system.begin[i + 1]; ++k) {
            sum += system.value[k] * x[system.column[k]];
        }
        y[i] = sum;
    }
}

// Conjugate gradients, preconditioned by the diagonal. On one thread, since sums added up in another order
// would have other bits.
Result<std::vector<double>> solve(const System& system, const RunContext& context) {
    const std::size_t n = system.diagonal.size();
    std::vector<double> x(n, 0.0);
    std::vector<double> residual = system.right;
    std::vector<double> direction(n);
    std::vector<double> product(n);
    double size = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        direction[i] = residual[i] / system.diagonal[i];
        size += residual[i] * direction[i];
    }
    const double enough = kResidual * kResidual * size;
    for (int iteration = 0; iteration < kMaxIterations && size > enough; ++iteration) {
        if (iteration % kIterationsBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        multiply(system, direction, product);
        double curvature = 0.0;
        for (std::size_t i = 0; i < n; ++i) curvature += direction[i] * product[i];
        const double step = size / curvature;
        double next = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            x[i] += step * direction[i];
            residual[i] -= step * product[i];
            next += residual[i] * residual[i] / system.diagonal[i];
        }
        const double carry = next / size;
        size = next;
        for (std::size_t i = 0; i < n; ++i) {
            direction[i] = residual[i] / system.diagonal[i] + carry * direction[i];
        }
    }
    return x;
}

}  // namespace

std::vector<Poles> findPoles(const PointCloud& points, const Tetrahedra& tetrahedra) {
    std::vector<Poles> poles(points.size());
    std::vector<std::uint8_t> onHull(points.size(), 0);
    std::vector<Point3> outwards(points.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        const auto& v = tetrahedra.vertices[t];
        for (std::size_t facet = 0; facet < 4; ++facet) {
            if (tetrahedra.neighbours[t][facet] != kNoTetrahedron) continue;
            const Point3 normal = outwardNormal(points, v, facet);
            for (std::size_t k = 1; k < 4; ++k) {
                const std::uint32_t corner = v[(facet + k) % 4];
                onHull[corner] = 1;
                outwards[corner] = outwards[corner] + normal;
            }
        }
        for (const std::uint32_t corner : v) {
            std::uint32_t& first = poles[corner].first;
            if (first == kNoTetrahedron || tetrahedra.circumradii[t] > tetrahedra.circumradii[first])
                first = t;
        }
    }
    // On the hull the half space outside is larger than any ball.
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (onHull[p]) {
            poles[p].first = kNoTetrahedron;
        } else {
            outwards[p] = tetrahedra.circumcentres[poles[p].first] - points[p];
        }
    }
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (const std::uint32_t corner : tetrahedra.vertices[t]) {
            std::uint32_t& second = poles[corner].second;
            if (second != kNoTetrahedron && tetrahedra.circumradii[t] <= tetrahedra.circumradii[second])
                continue;
            // Needs the final directions outwards, hence a pass of its own. Of equal balls the first counts,
            // as above.
            if (dot(outwards[corner], tetrahedra.circumcentres[t] - points[corner]) < 0.0) second = t;
        }
    }
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (poles[p].second == kNoTetrahedron) continue;
        const Point3 inwards = tetrahedra.circumcentres[poles[p].second] - points[p];
        poles[p].cosine = dot(outwards[p], inwards) / (length(outwards[p]) * length(inwards));
    }
    return poles;
}

Result<std::vector<double>> insidePotential(const PointCloud& points, const Tetrahedra& tetrahedra,
                                            const std::vector<Poles>& poles, const RunContext& context) {
    const System system = assemble(tetrahedra.size(), collectBonds(points, tetrahedra, poles));
    return solve(system, context);
}

}  // namespace shapedb
