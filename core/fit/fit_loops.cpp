// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/fit_loops.h"

#include <cstring>

namespace shapedb {

namespace {

struct Vector8 {
    Float8 x, y, z;
};

SHAPEDB_LANES Vector8 loadVector(const float* x, const float* y, const float* z, std::size_t at) {
    return {loadLanes(x + at), loadLanes(y + at), loadLanes(z + at)};
}
SHAPEDB_LANES Float8 dot8(const Vector8& a, const Vector8& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SHAPEDB_LANES Vector8 minus(const Vector8& a, const Vector8& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
SHAPEDB_LANES Vector8 cross8(const Vector8& a, const Vector8& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
SHAPEDB_LANES Vector8 moved(const Affine& f, const Vector8& p) {
    return {f.m[0] * p.x + f.m[1] * p.y + f.m[2] * p.z + f.t[0],
            f.m[3] * p.x + f.m[4] * p.y + f.m[5] * p.z + f.t[1],
            f.m[6] * p.x + f.m[7] * p.y + f.m[8] * p.z + f.t[2]};
}

// Samples nearest to eight places, and their normals.
struct Nearest8 {
    Vector8 point;
    Vector8 normal;
};

SHAPEDB_LANES Float8 lowHalves(const Float8& a, const Float8& b) {
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
}
SHAPEDB_LANES Float8 highHalves(const Float8& a, const Float8& b) {
    return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}

SHAPEDB_LANES Nearest8 nearestTo(const NearestGrid& grid, const Vector8& p) {
    const float s = grid.scale();
    const auto& o = grid.offset();
    const Int8 cells = cellsAt(grid, s * p.x + o[0], s * p.y + o[1], s * p.z + o[2]);
    const std::uint16_t* nearest = grid.nearest();
    const NearestGrid::Entry* entries = grid.entries();
    std::array<Float8, kFloatLanes> rows;
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
        std::memcpy(&rows[lane], &entries[nearest[cells[lane]]], sizeof(NearestGrid::Entry));
    }
    // Rows to columns, in halves of four: x, y, z and padding; the three coordinates of the normal and
    // padding.
    const auto& r = rows;
    const Float8 a = __builtin_shufflevector(r[0], r[1], 0, 8, 1, 9, 4, 12, 5, 13);
    const Float8 b = __builtin_shufflevector(r[2], r[3], 0, 8, 1, 9, 4, 12, 5, 13);
    const Float8 c = __builtin_shufflevector(r[4], r[5], 0, 8, 1, 9, 4, 12, 5, 13);
    const Float8 d = __builtin_shufflevector(r[6], r[7], 0, 8, 1, 9, 4, 12, 5, 13);
    const Float8 e = __builtin_shufflevector(r[0], r[1], 2, 10, 3, 11, 6, 14, 7, 15);
    const Float8 f = __builtin_shufflevector(r[2], r[3], 2, 10, 3, 11, 6, 14, 7, 15);
    const Float8 g = __builtin_shufflevector(r[4], r[5], 2, 10, 3, 11, 6, 14, 7, 15);
    const Float8 h = __builtin_shufflevector(r[6], r[7], 2, 10, 3, 11, 6, 14, 7, 15);
    // Each holds one coordinate of four points, then that of their normals.
    const Float8 x0 = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
    const Float8 x1 = __builtin_shufflevector(c, d, 0, 1, 8, 9, 4, 5, 12, 13);
    const Float8 y0 = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    const Float8 y1 = __builtin_shufflevector(c, d, 2, 3, 10, 11, 6, 7, 14, 15);
    const Float8 z0 = __builtin_shufflevector(e, f, 0, 1, 8, 9, 4, 5, 12, 13);
    const Float8 z1 = __builtin_shufflevector(g, h, 0, 1, 8, 9, 4, 5, 12, 13);
    return {{lowHalves(x0, x1), lowHalves(y0, y1), lowHalves(z0, z1)},
            {highHalves(x0, x1), highHalves(y0, y1), highHalves(z0, z1)}};
}

SHAPEDB_LANES Float8 squaredGap(const Vector8& difference, const Vector8& normal, const Gauge& gauge) {
    const Float8 off = dot8(normal, difference);
    const Float8 along = dot8(difference, difference) - off * off;
    return gauge.unit * (off * off + greater(along - gauge.forgiven, Float8{}));
}

// 1 / (1 + d^2 / w^2)
SHAPEDB_LANES Float8 nearness(const Vector8& difference, const Vector8& normal, const Gauge& gauge) {
    return 1.0f / (1.0f + gauge.overWidth * squaredGap(difference, normal, gauge));
}

SHAPEDB_LANES void moveBody(const SurfaceColumns& points, std::size_t count, const Affine& motion, float* x,
                            float* y, float* z) {
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = moved(motion, loadVector(points.x.data(), points.y.data(), points.z.data(), i));
        storeLanes(x + i, p.x);
        storeLanes(y + i, p.y);
        storeLanes(z + i, p.z);
    }
}

SHAPEDB_LANES WeightedSum explainedBody(const NearestGrid& grid, const float* x, const float* y,
                                        const float* z, const float* weights, std::size_t count,
                                        const Gauge& gauge) {
    Float8 sum{};
    Float8 weight{};
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = loadVector(x, y, z, i);
        const Nearest8 found = nearestTo(grid, p);
        const Float8 near = nearness(minus(p, found.point), found.normal, gauge);
        const Float8 w = weights == nullptr ? allLanes(1.0f) : loadLanes(weights + i);
        sum += w * near * near;
        weight += w;
    }
    return {sumOfLanes(sum), sumOfLanes(weight)};
}

SHAPEDB_LANES void insideBody(const NearestGrid& grid, const std::uint8_t* inside, const float* x,
                              const float* y, const float* z, std::size_t count, float* weights) {
    const float s = grid.scale();
    const auto& o = grid.offset();
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = loadVector(x, y, z, i);
        const Int8 cells = cellsAt(grid, s * p.x + o[0], s * p.y + o[1], s * p.z + o[2]);
        for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
            weights[i + lane] = static_cast<float>(inside[cells[lane]]);
        }
    }
}

SHAPEDB_LANES std::uint32_t closenessBody(const NearestGrid& grid, const float* x, const float* y,
                                          const float* z, std::size_t count,
                                          const std::array<float, 3>& offset) {
    const std::uint8_t* closeness = grid.closeness();
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = loadVector(x, y, z, i);
        const Int8 cells = cellsAt(grid, p.x + offset[0], p.y + offset[1], p.z + offset[2]);
        for (std::size_t lane = 0; lane < kFloatLanes; ++lane) sum += closeness[cells[lane]];
    }
    return sum;
}

constexpr float kPointShare = 0.1f;  // of the weight of point to plane

struct StepLanes {
    std::array<Float8, StepSums::kPlane> plane{};
    std::array<Float8, StepSums::kPoint> point{};
};

// The pair of a moved point y and its target, where the plane has normal n.
SHAPEDB_LANES void addPair(const Vector8& y, const Vector8& target, const Vector8& n, const Float8& weight,
                           StepLanes& lanes) {
    const Vector8 e = minus(y, target);
    const Vector8 turn = cross8(y, n);
    const std::array<Float8, 8> row = {turn.x, turn.y, turn.z, n.x, n.y, n.z, dot8(n, y), dot8(n, e)};
    std::size_t at = 0;
    for (std::size_t i = 0; i < StepSums::kUnknowns; ++i) {
        const Float8 scaled = weight * row[i];
        for (std::size_t j = i; j < row.size(); ++j) lanes.plane[at++] += scaled * row[j];
    }
    const Float8 w = kPointShare * weight;
    const Vector8 wy = {w * y.x, w * y.y, w * y.z};
    const Vector8 torque = cross8(wy, e);
    const std::array<Float8, StepSums::kPoint> terms = {
        w,          wy.x,    wy.y,    wy.z,    wy.x * y.x, wy.x * y.y, wy.x * y.z, wy.y * y.y, wy.y * y.z,
        wy.z * y.z, w * e.x, w * e.y, w * e.z, torque.x,   torque.y,   torque.z,   dot8(wy, e)};
    for (std::size_t i = 0; i < terms.size(); ++i) lanes.point[i] += terms[i];
}

SHAPEDB_LANES void addLanes(const StepLanes& lanes, double factor, StepSums& sums) {
    for (std::size_t i = 0; i < lanes.plane.size(); ++i) {
        sums.plane[i] += factor * static_cast<double>(sumOfLanes(lanes.plane[i]));
    }
    for (std::size_t i = 0; i < lanes.point.size(); ++i) {
        sums.point[i] += factor * static_cast<double>(sumOfLanes(lanes.point[i]));
    }
}

SHAPEDB_LANES void toQueryBody(const NearestGrid& query, const float* x, const float* y, const float* z,
                               const float* weights, std::size_t count, const Gauge& gauge, float factor,
                               StepSums& sums) {
    StepLanes lanes;
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = loadVector(x, y, z, i);
        const Nearest8 found = nearestTo(query, p);
        const Float8 near = nearness(minus(p, found.point), found.normal, gauge);
        const Float8 w = weights == nullptr ? allLanes(1.0f) : loadLanes(weights + i);
        addPair(p, found.point, found.normal, w * near * near * near, lanes);
    }
    addLanes(lanes, static_cast<double>(factor), sums);
}

SHAPEDB_LANES void toOtherBody(const NearestGrid& other, const SurfaceColumns& query, const float* x,
                               const float* y, const float* z, std::size_t count, const Affine& forward,
                               const Affine& normals, const Gauge& gauge, float factor, StepSums& sums) {
    StepLanes lanes;
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = loadVector(x, y, z, i);
        const Nearest8 found = nearestTo(other, p);
        const Float8 near = nearness(minus(p, found.point), found.normal, gauge);
        const Vector8 q = loadVector(query.x.data(), query.y.data(), query.z.data(), i);
        addPair(moved(forward, found.point), q, moved(normals, found.normal), near * near * near, lanes);
    }
    addLanes(lanes, static_cast<double>(factor), sums);
}

SHAPEDB_WIDE void moveWide(const SurfaceColumns& points, std::size_t count, const Affine& motion, float* x,
                           float* y, float* z) {
    moveBody(points, count, motion, x, y, z);
}
SHAPEDB_WIDE WeightedSum explainedWide(const NearestGrid& grid, const float* x, const float* y,
                                       const float* z, const float* weights, std::size_t count,
                                       const Gauge& gauge) {
    return explainedBody(grid, x, y, z, weights, count, gauge);
}
SHAPEDB_WIDE void insideWide(const NearestGrid& grid, const std::uint8_t* inside, const float* x,
                             const float* y, const float* z, std::size_t count, float* weights) {
    insideBody(grid, inside, x, y, z, count, weights);
}
SHAPEDB_WIDE std::uint32_t closenessWide(const NearestGrid& grid, const float* x, const float* y,
                                         const float* z, std::size_t count,
                                         const std::array<float, 3>& offset) {
    return closenessBody(grid, x, y, z, count, offset);
}
SHAPEDB_WIDE void toQueryWide(const NearestGrid& query, const float* x, const float* y, const float* z,
                              const float* weights, std::size_t count, const Gauge& gauge, float factor,
                              StepSums& sums) {
    toQueryBody(query, x, y, z, weights, count, gauge, factor, sums);
}
SHAPEDB_WIDE void toOtherWide(const NearestGrid& other, const SurfaceColumns& query, const float* x,
                              const float* y, const float* z, std::size_t count, const Affine& forward,
                              const Affine& normals, const Gauge& gauge, float factor, StepSums& sums) {
    toOtherBody(other, query, x, y, z, count, forward, normals, gauge, factor, sums);
}

}  // namespace

Affine::Affine(const Motion& motion) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            m[3 * i + j] = static_cast<float>(motion.scale * motion.rotation[i][j]);
        }
    }
    t = {static_cast<float>(motion.translation.x), static_cast<float>(motion.translation.y),
         static_cast<float>(motion.translation.z)};
}

void moveColumns(const SurfaceColumns& points, std::size_t count, const Affine& motion, float* x, float* y,
                 float* z) {
    if (processorIsWide()) return moveWide(points, count, motion, x, y, z);
    moveBody(points, count, motion, x, y, z);
}

WeightedSum explainedBy(const NearestGrid& grid, const float* x, const float* y, const float* z,
                        const float* weights, std::size_t count, const Gauge& gauge) {
    if (processorIsWide()) return explainedWide(grid, x, y, z, weights, count, gauge);
    return explainedBody(grid, x, y, z, weights, count, gauge);
}

void squaredDistances(const NearestGrid& grid, const float* x, const float* y, const float* z,
                      std::size_t count, const Gauge& gauge, float* out) {
    for (std::size_t i = 0; i < count; i += kFloatLanes) {
        const Vector8 p = loadVector(x, y, z, i);
        const Nearest8 found = nearestTo(grid, p);
        storeLanes(out + i, squaredGap(minus(p, found.point), found.normal, gauge));
    }
}

void weighInside(const NearestGrid& grid, const std::uint8_t* inside, const float* x, const float* y,
                 const float* z, std::size_t count, float* weights) {
    if (processorIsWide()) return insideWide(grid, inside, x, y, z, count, weights);
    insideBody(grid, inside, x, y, z, count, weights);
}

std::uint32_t closenessSum(const NearestGrid& grid, const float* x, const float* y, const float* z,
                           std::size_t count, const std::array<float, 3>& offset) {
    if (processorIsWide()) return closenessWide(grid, x, y, z, count, offset);
    return closenessBody(grid, x, y, z, count, offset);
}

void addPairsToQuery(const NearestGrid& query, const float* x, const float* y, const float* z,
                     const float* weights, std::size_t count, const Gauge& gauge, float factor,
                     StepSums& sums) {
    if (processorIsWide()) return toQueryWide(query, x, y, z, weights, count, gauge, factor, sums);
    toQueryBody(query, x, y, z, weights, count, gauge, factor, sums);
}

void addPairsToOther(const NearestGrid& other, const SurfaceColumns& query, const float* x, const float* y,
                     const float* z, std::size_t count, const Affine& forward, const Affine& normals,
                     const Gauge& gauge, float factor, StepSums& sums) {
    if (processorIsWide())
        return toOtherWide(other, query, x, y, z, count, forward, normals, gauge, factor, sums);
    toOtherBody(other, query, x, y, z, count, forward, normals, gauge, factor, sums);
}

}  // namespace shapedb
