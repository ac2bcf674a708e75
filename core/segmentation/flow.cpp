#include "core/segmentation/flow.h"

#include <cmath>

#include "core/segmentation/exact_geometry.h"

namespace shapedb {

namespace {

// Rounding moves a barycentric coordinate of the circumcentre by a few units of 1e-16 times
// the square of the inverse shape factor (the determinant against its edges); with a thousand
// times that as a margin a wrong sign would need a thousandfold underestimate.
constexpr double kRounding = 1e-13;

constexpr std::size_t kTetrahedraBetweenCheckpoints = 4096;

// Signs of the circumcentre's barycentric coordinates, or false when one is too close to call.
// The centre is computed afresh, relative to a corner: rounded to the frame's origin it would have
// lost its digits where tetrahedra are small.
bool approximateFlowMask(const TetrahedronCorners& p, unsigned& mask) {
    const Point3 a = p[1] - p[0];
    const Point3 b = p[2] - p[0];
    const Point3 c = p[3] - p[0];
    const Point3 bc = cross(b, c);
    const Point3 ca = cross(c, a);
    const Point3 ab = cross(a, b);
    const double sixVolumes = dot(a, bc);
    const double size = length(a) * length(b) * length(c);
    if (!(sixVolumes > 1e-6 * size)) return false;
    const Point3 g =
        (0.5 / sixVolumes) * (squaredLength(a) * bc + squaredLength(b) * ca + squaredLength(c) * ab);
    const double second = dot(g, bc);
    const double third = dot(g, ca);
    const double fourth = dot(g, ab);
    const double coordinates[4] = {sixVolumes - second - third - fourth, second, third, fourth};
    const double reach = length(g) * (length(bc) + length(a) * (length(b) + length(c))) + sixVolumes;
    const double margin = kRounding * reach * (size / sixVolumes);
    mask = 0;
    for (unsigned i = 0; i < 4; ++i) {
        if (std::abs(coordinates[i]) <= margin) return false;
        if (coordinates[i] < 0.0) mask |= 1u << i;
    }
    return true;
}

}  // namespace

Result<std::vector<std::uint8_t>> flowMasks(const PointCloud& points, const Tetrahedra& tetrahedra,
                                            const std::vector<std::uint8_t>& wanted,
                                            const RunContext& context) {
    std::vector<std::uint8_t> masks(tetrahedra.size(), 0);
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        if (t % kTetrahedraBetweenCheckpoints == 0) {
            if (auto go = context.checkpoint(); !go) return fail(go.error());
        }
        if (!wanted[t]) continue;
        const auto& v = tetrahedra.vertices[t];
        const TetrahedronCorners corners = {points[v[0]], points[v[1]], points[v[2]], points[v[3]]};
        unsigned mask = 0;
        if (!approximateFlowMask(corners, mask)) mask = exactFlowMask(corners);
        masks[t] = static_cast<std::uint8_t>(mask);
    }
    return masks;
}

}  // namespace shapedb
