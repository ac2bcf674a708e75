#include "core/segmentation/point_scale.h"

#include <array>
#include <cmath>
#include <limits>

namespace shapedb {

namespace {

constexpr std::size_t kNeighbours = 3;
constexpr std::uint32_t kNone = 0xffffffffu;

// The tetrahedra around each point, one after the other (compressed rows).
struct Stars {
    std::vector<std::uint32_t> begin;  // per point, plus the end of the last
    std::vector<std::uint32_t> tetrahedra;
};

Stars buildStars(std::size_t pointCount, const Tetrahedra& tetrahedra) {
    Stars stars;
    stars.begin.assign(pointCount + 1, 0);
    for (const auto& vertices : tetrahedra.vertices) {
        for (const std::uint32_t v : vertices) ++stars.begin[v + 1];
    }
    for (std::size_t v = 0; v < pointCount; ++v) stars.begin[v + 1] += stars.begin[v];
    stars.tetrahedra.resize(stars.begin.back());
    std::vector<std::uint32_t> next(stars.begin.begin(), stars.begin.end() - 1);
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        for (const std::uint32_t v : tetrahedra.vertices[t]) {
            stars.tetrahedra[next[v]++] = static_cast<std::uint32_t>(t);
        }
    }
    return stars;
}

// The nearest points seen so far, by rising squared distance.
class Nearest {
  public:
    void offer(std::uint32_t point, double squared) {
        if (squared >= squared_.back()) return;
        for (const std::uint32_t known : points_) {
            if (known == point) return;
        }
        std::size_t at = kNeighbours - 1;
        for (; at > 0 && squared_[at - 1] > squared; --at) {
            squared_[at] = squared_[at - 1];
            points_[at] = points_[at - 1];
        }
        squared_[at] = squared;
        points_[at] = point;
    }

    std::uint32_t point(std::size_t rank) const { return points_[rank]; }

    double meanDistance() const {
        double sum = 0.0;
        for (const double s : squared_) sum += std::sqrt(s);
        return sum / static_cast<double>(kNeighbours);
    }

  private:
    std::array<std::uint32_t, kNeighbours> points_{kNone, kNone, kNone};
    std::array<double, kNeighbours> squared_{std::numeric_limits<double>::infinity(),
                                             std::numeric_limits<double>::infinity(),
                                             std::numeric_limits<double>::infinity()};
};

}  // namespace

std::vector<double> pointScales(const PointCloud& points, const Tetrahedra& tetrahedra) {
    const Stars stars = buildStars(points.size(), tetrahedra);
    std::vector<double> scales(points.size());
    for (std::uint32_t p = 0; p < points.size(); ++p) {
        Nearest nearest;
        const auto offerLinkOf = [&](std::uint32_t centre) {
            for (std::uint32_t i = stars.begin[centre]; i < stars.begin[centre + 1]; ++i) {
                for (const std::uint32_t v : tetrahedra.vertices[stars.tetrahedra[i]]) {
                    if (v != p) nearest.offer(v, squaredDistance(points[p], points[v]));
                }
            }
        };
        offerLinkOf(p);
        // Rank 0 is final now; looking around it makes rank 1 final, and around that rank 2.
        for (std::size_t rank = 0; rank + 1 < kNeighbours; ++rank) offerLinkOf(nearest.point(rank));
        scales[p] = nearest.meanDistance();
    }
    return scales;
}

}  // namespace shapedb
