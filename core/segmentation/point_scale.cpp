#include "core/segmentation/point_scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/base/large_block.h"

namespace shapedb {

namespace {

constexpr std::size_t kNeighbours = 3;
constexpr std::uint32_t kNone = 0xffffffffu;

// How many of its nearest Delaunay neighbours each point keeps: enough that hardly ever another one
// matters to a point next to it.
constexpr std::size_t kKept = 5;

// Distances are compared after rounding; so much wider the search is safe.
constexpr double kSlack = 1.0 + 1e-12;

// The nearest points seen so far, by rising squared distance.
template <std::size_t kCount>
struct Nearest {
    std::array<double, kCount> squared;
    std::array<std::uint32_t, kCount> points;

    Nearest() {
        squared.fill(std::numeric_limits<double>::infinity());
        points.fill(kNone);
    }

    void offer(std::uint32_t point, double distance) {
        if (distance >= squared.back()) return;
        for (const std::uint32_t known : points) {
            if (known == point) return;
        }
        std::size_t at = kCount - 1;
        for (; at > 0 && squared[at - 1] > distance; --at) {
            squared[at] = squared[at - 1];
            points[at] = points[at - 1];
        }
        squared[at] = distance;
        points[at] = point;
    }
};

using Kept = LargeVector<Nearest<kKept>>;

// The edges of a tetrahedron, by corners, and the two other corners.
constexpr std::array<std::array<std::size_t, 4>, 6> kEdges = {
    {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}}};

// The nearest Delaunay neighbours of every point, in one pass over the tetrahedra. Those around an edge
// follow one another through the facets that hold it. The first of them has two neighbours after itself
// there: only such a one looks at the edge.
Kept nearestNeighbours(const PointCloud& points, const Tetrahedra& tetrahedra) {
    Kept kept(points.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        const auto& v = tetrahedra.vertices[t];
        const auto& next = tetrahedra.neighbours[t];
        for (const auto& [i, j, k, l] : kEdges) {
            if (std::min(next[k], next[l]) < t) continue;
            const double squared = squaredDistance(points[v[i]], points[v[j]]);
            kept[v[i]].offer(v[j], squared);
            kept[v[j]].offer(v[i], squared);
        }
    }
    return kept;
}

// The tetrahedra around a point, found by stepping through facets from one of them.
class Stars {
  public:
    Stars(const Tetrahedra& tetrahedra, std::size_t pointCount) : tetrahedra_(tetrahedra), any_(pointCount) {
        for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
            for (const std::uint32_t v : tetrahedra.vertices[t]) any_[v] = t;
        }
    }

    template <typename Visit>
    void forEachVertexAround(std::uint32_t centre, Visit visit) {
        star_.assign(1, any_[centre]);
        for (std::size_t k = 0; k < star_.size(); ++k) {
            const std::uint32_t t = star_[k];
            for (std::size_t i = 0; i < 4; ++i) {
                const std::uint32_t v = tetrahedra_.vertices[t][i];
                if (v == centre) continue;
                visit(v);
                const std::uint32_t next = tetrahedra_.neighbours[t][i];
                if (next == kNoTetrahedron || std::find(star_.begin(), star_.end(), next) != star_.end()) {
                    continue;
                }
                star_.push_back(next);
            }
        }
    }

  private:
    const Tetrahedra& tetrahedra_;
    std::vector<std::uint32_t> any_;
    std::vector<std::uint32_t> star_;
};

}  // namespace

// A point q near p that is not adjacent to it is adjacent to an r inside the ball with diameter pq: grow
// a ball from q along the way to p until it touches a point. So |rq|^2 <= |pq|^2 - |pr|^2, which bounds
// the search around r.
std::vector<double> pointScales(const PointCloud& points, const Tetrahedra& tetrahedra) {
    const Kept kept = nearestNeighbours(points, tetrahedra);
    Stars stars(tetrahedra, points.size());
    std::vector<double> scales(points.size());
    for (std::uint32_t p = 0; p < points.size(); ++p) {
        Nearest<kNeighbours> nearest;
        for (std::size_t i = 0; i < kNeighbours; ++i) {
            nearest.squared[i] = kept[p].squared[i];
            nearest.points[i] = kept[p].points[i];
        }
        const auto offer = [&](std::uint32_t q) {
            if (q != p) nearest.offer(q, squaredDistance(points[p], points[q]));
        };
        // Rank 0 is final; looking around it makes rank 1 final, and around that rank 2.
        for (std::size_t rank = 0; rank + 1 < kNeighbours; ++rank) {
            const std::uint32_t r = nearest.points[rank];
            const double reach = kSlack * nearest.squared.back() - nearest.squared[rank];
            if (kept[r].squared.back() > reach) {
                for (const std::uint32_t q : kept[r].points) {
                    if (q != kNone) offer(q);
                }
            } else {
                stars.forEachVertexAround(r, offer);
            }
        }
        double sum = 0.0;
        for (const double squared : nearest.squared) sum += std::sqrt(squared);
        scales[p] = sum / static_cast<double>(kNeighbours);
    }
    return scales;
}

}  // namespace shapedb
