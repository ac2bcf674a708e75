// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/flow.h"

#include <array>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"
#include "core/geometry/vec3x2.h"

namespace shapedb {

namespace {

// Rounding moves a barycentric coordinate of the circumcentre by a few units of 1e-16 times the square of
// the inverse shape factor (edges over determinant). The margin is a thousand times that.
constexpr double kRounding = 1e-13;

// Flatter tetrahedra go straight to exact arithmetic: six volumes over the product of the edges at a corner.
constexpr double kLeastShare = 1e-6;

// Tetrahedra per task.
constexpr std::size_t kBlock = 4096;

// The 1-norm: no less than the length, and cheaper.
Double2 lengthAtMost(const Vec3x2& a) { return abs(a.x) + abs(a.y) + abs(a.z); }

// Masks of two tetrahedra, from the signs of the barycentric coordinates of their circumcentres. The centres
// are computed afresh, relative to a corner: the stored ones, relative to the origin of the frame, have lost
// their digits where tetrahedra are small.
struct FlowMasks {
    std::array<unsigned, 2> mask;
    unsigned sure;  // bits 0 and 1: the mask is certain
};

FlowMasks approximateFlowMasks(const Vec3x2& a, const Vec3x2& b, const Vec3x2& c) {
    const Vec3x2 bc = cross(b, c);
    const Vec3x2 ca = cross(c, a);
    const Vec3x2 ab = cross(a, b);
    const Double2 sixVolumes = dot(a, bc);
    const Double2 toA = lengthAtMost(a), toB = lengthAtMost(b), toC = lengthAtMost(c);
    const Double2 size = toA * toB * toC;
    // The circumcentre, seen from the first corner.
    const Vec3x2 g =
        (Double2(0.5) / sixVolumes) * (squaredLength(a) * bc + squaredLength(b) * ca + squaredLength(c) * ab);
    // Barycentric coordinates times the six-fold volume: where that is positive, the signs are the same.
    const Double2 second = dot(g, bc);
    const Double2 third = dot(g, ca);
    const Double2 fourth = dot(g, ab);
    const std::array<Double2, 4> coordinates = {sixVolumes - second - third - fourth, second, third, fourth};
    const Double2 reach = lengthAtMost(g) * (lengthAtMost(bc) + toA * (toB + toC)) + sixVolumes;
    const Double2 margin = Double2(kRounding) * reach * (size / sixVolumes);
    // Fails for a volume that rounding made zero or negative, too: nothing above means anything then.
    FlowMasks masks{{0, 0}, less(Double2(kLeastShare) * size, sixVolumes)};
    for (unsigned i = 0; i < 4; ++i) {
        masks.sure &= less(margin, abs(coordinates[i]));
        const unsigned beyond = less(coordinates[i], 0.0);
        masks.mask[0] |= (beyond & 1u) << i;
        masks.mask[1] |= (beyond >> 1) << i;
    }
    return masks;
}

// Computes the masks of two tetrahedra, which may be the same. Two neighbours that each took the other for
// downstream would make a cycle, so what rounding leaves open is decided exactly.
void maskTwo(const PointCloud& points, const Tetrahedra& tetrahedra, const std::array<std::uint32_t, 2>& two,
             std::vector<std::uint8_t>& masks) {
    const auto& v = tetrahedra.vertices[two[0]];
    const auto& w = tetrahedra.vertices[two[1]];
    const Vec3x2 first(points[v[0]], points[w[0]]);
    const auto edgeTo = [&](std::size_t i) { return Vec3x2(points[v[i]], points[w[i]]) - first; };
    const FlowMasks found = approximateFlowMasks(edgeTo(1), edgeTo(2), edgeTo(3));
    for (std::size_t k = 0; k < 2; ++k) {
        unsigned mask = found.mask[k];
        if ((found.sure >> k & 1u) == 0) {
            mask = exactFlowMask(cornersOf(points, tetrahedra.vertices[two[k]]));
        }
        masks[two[k]] = static_cast<std::uint8_t>(mask);
    }
}

}  // namespace

Result<std::vector<std::uint8_t>> flowMasks(const PointCloud& points, const Tetrahedra& tetrahedra,
                                            const std::vector<std::uint8_t>& wanted,
                                            const RunContext& context) {
    std::vector<std::uint8_t> masks(tetrahedra.size(), 0);
    auto done = parallelFor(tetrahedra.size(), kBlock, context, [&](std::size_t from, std::size_t to) {
        std::array<std::uint32_t, 2> two{};
        std::size_t waiting = 0;
        for (std::size_t t = from; t < to; ++t) {
            if (!wanted[t]) continue;
            two[waiting++] = static_cast<std::uint32_t>(t);
            if (waiting < 2) continue;
            maskTwo(points, tetrahedra, two, masks);
            waiting = 0;
        }
        if (waiting == 1) maskTwo(points, tetrahedra, {two[0], two[0]}, masks);
    });
    RETURN_IF_ERROR(done);
    return masks;
}

}  // namespace shapedb
