// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <new>
#include <numeric>
#include <utility>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/geometry/box.h"
#include "core/geometry/motion.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/principal_axes.h"
#include "core/preparation/surroundings.h"

namespace shapedb {

namespace {

// Scans with more points are represented by this many of them.
constexpr std::size_t kMostPoints = 20000;
constexpr std::size_t kFewestPoints = 16;

// How many planes through three random points are tried: enough to find a plane with a fifth of the points
// almost certainly.
constexpr int kDraws = 1500;
constexpr std::size_t kCountedPoints = 2000;  // among which the points of a drawn plane are counted
constexpr int kPlanes = 3;                    // looked at, most points first

// Shares of the diagonal of the scan: the distance up to which points are counted, and bounds of the distance
// up to which they belong to the fitted plane.
constexpr double kCountedWithin = 0.006;
constexpr double kLeastWithin = 0.002;
constexpr double kWithinDeviations = 3.0;  // of its own points

constexpr double kLeastPlaneShare = 0.1;
constexpr double kLeastRestShare = 0.03;
constexpr double kOneSideShare = 0.95;

// The plane and what stands on it are compared in cells of this share of the diagonal. The plane reaches
// beyond what stands on it if the cells with nothing above are at least this many times those with something.
constexpr double kCell = 1.0 / 48.0;
constexpr double kBeyond = 0.3;
// It must do so in kLeastDirections of kDirections directions, seen from the middle of what is above.
constexpr std::size_t kDirections = 16;
constexpr std::size_t kLeastDirections = 11;
// And at least this share of what is above must be above the convex hull of the plane's points: a handle is
// not above a blade.
constexpr double kAbovePlane = 0.8;

// An object has at least this share of all points off the plane, or of the points of the largest object: each
// of a hundred equal ones has only a hundredth of all.
constexpr double kLeastObject = 0.02;
constexpr double kLikeLargest = 0.25;

struct Plane {
    Point3 point;
    Point3 normal;

    double height(const Point3& p) const { return dot(normal, p - point); }
};

std::optional<Plane> through(const Point3& a, const Point3& b, const Point3& c) {
    const Point3 n = cross(b - a, c - a);
    const double area = length(n);
    if (!(area > 0.0)) return std::nullopt;
    return Plane{a, (1.0 / area) * n};
}

std::size_t countNear(const PointCloud& points, const std::vector<std::uint32_t>& among, const Plane& plane,
                      double within) {
    return static_cast<std::size_t>(std::count_if(among.begin(), among.end(), [&](std::uint32_t i) {
        return std::abs(plane.height(points[i])) <= within;
    }));
}

// By least squares to the points of `among` that are near.
Plane fitted(const PointCloud& points, const std::vector<std::uint32_t>& among, const Plane& plane,
             double within) {
    PointCloud near;
    for (const std::uint32_t i : among) {
        if (std::abs(plane.height(points[i])) <= within) near.push_back(points[i]);
    }
    if (near.size() < 3) return plane;
    Point3 sum;
    for (const Point3& p : near) sum = sum + p;
    const std::array<double, 3> normal = principalAxes(near)[2];
    return {(1.0 / static_cast<double>(near.size())) * sum, {normal[0], normal[1], normal[2]}};
}

// Cells of the plane, each once.
class Footprint {
  public:
    Footprint(const Plane& plane, double cell)
        : plane_(plane), cell_(cell), u_(anyPerpendicular(plane.normal)), v_(cross(plane.normal, u_)) {}
    using Cell = std::pair<int, int>;
    Cell cellOf(const Point3& p) const {
        const Point3 d = p - plane_.point;
        return {static_cast<int>(std::floor(dot(d, u_) / cell_)),
                static_cast<int>(std::floor(dot(d, v_) / cell_))};
    }

  private:
    Plane plane_;
    double cell_;
    Point3 u_, v_;
};

// Corners of the convex hull of sorted cells, counter-clockwise (Andrew's monotone chain).
std::vector<Footprint::Cell> hullOf(const std::vector<Footprint::Cell>& sorted) {
    using Cell = Footprint::Cell;
    const auto turn = [](const Cell& a, const Cell& b, const Cell& c) {
        return static_cast<long>(b.first - a.first) * (c.second - a.second) -
               static_cast<long>(b.second - a.second) * (c.first - a.first);
    };
    std::vector<Cell> hull;
    const auto chain = [&](auto begin, auto end) {
        const std::size_t first = hull.size();
        for (auto cell = begin; cell != end; ++cell) {
            while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), *cell) <= 0)
                hull.pop_back();
            hull.push_back(*cell);
        }
        hull.pop_back();  // it begins the other chain
    };
    chain(sorted.begin(), sorted.end());
    chain(sorted.rbegin(), sorted.rend());
    return hull;
}

bool isInside(const Footprint::Cell& cell, const std::vector<Footprint::Cell>& hull) {
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Footprint::Cell& a = hull[i];
        const Footprint::Cell& b = hull[(i + 1) % hull.size()];
        if (static_cast<long>(b.first - a.first) * (cell.second - a.second) <
            static_cast<long>(b.second - a.second) * (cell.first - a.first)) {
            return false;
        }
    }
    return true;
}

// Whether the cells of a plane lie on all sides of what is covered, or nearly so: a table reaches beyond what
// stands on it wherever one looks from there, the flat handle of a spoon only beyond one end of the bowl.
bool isAround(const std::vector<Footprint::Cell>& cells, const std::vector<Footprint::Cell>& covered) {
    double x = 0.0;
    double y = 0.0;
    for (const Footprint::Cell& cell : covered) {
        x += cell.first;
        y += cell.second;
    }
    const auto count = static_cast<double>(covered.size());
    std::array<std::size_t, kDirections> seen{};
    for (const Footprint::Cell& cell : cells) {
        const double turn = std::atan2(cell.second - y / count, cell.first - x / count) / (2.0 * kPi) + 0.5;
        ++seen[std::min(kDirections - 1, static_cast<std::size_t>(turn * kDirections))];
    }
    const auto open = static_cast<std::size_t>(
        std::count_if(seen.begin(), seen.end(), [](std::size_t n) { return n > 0; }));
    return open >= kLeastDirections;
}

// Whether what is not on the plane stands on it; turns the normal towards it.
bool supports(const PointCloud& points, Plane& plane, double within, double diagonal) {
    std::size_t above = 0;
    std::size_t below = 0;
    for (const Point3& p : points) {
        const double height = plane.height(p);
        above += height > within ? 1 : 0;
        below += height < -within ? 1 : 0;
    }
    const auto all = static_cast<double>(points.size());
    const auto rest = static_cast<double>(above + below);
    if (rest < kLeastRestShare * all || rest > (1.0 - kLeastPlaneShare) * all) return false;
    if (static_cast<double>(std::max(above, below)) < kOneSideShare * rest) return false;
    if (below > above) plane.normal = -1.0 * plane.normal;

    const Footprint footprint(plane, kCell * diagonal);
    std::vector<Footprint::Cell> flat;
    std::vector<Footprint::Cell> covered;
    for (const Point3& p : points) {
        const Footprint::Cell cell = footprint.cellOf(p);
        if (std::abs(plane.height(p)) <= within) {
            flat.push_back(cell);
        } else {
            // Its neighbours too, so that the rim of what stands there does not count as beyond it.
            for (const int dx : {-1, 0, 1}) {
                for (const int dy : {-1, 0, 1}) covered.emplace_back(cell.first + dx, cell.second + dy);
            }
        }
    }
    for (auto* cells : {&flat, &covered}) {
        std::sort(cells->begin(), cells->end());
        cells->erase(std::unique(cells->begin(), cells->end()), cells->end());
    }
    std::vector<Footprint::Cell> beyond;
    std::set_difference(flat.begin(), flat.end(), covered.begin(), covered.end(), std::back_inserter(beyond));
    if (static_cast<double>(beyond.size()) < kBeyond * static_cast<double>(covered.size())) return false;
    if (!isAround(beyond, covered)) return false;
    const std::vector<Footprint::Cell> hull = hullOf(flat);
    const auto inside = std::count_if(points.begin(), points.end(), [&](const Point3& p) {
        return plane.height(p) > within && isInside(footprint.cellOf(p), hull);
    });
    return static_cast<double>(inside) >= kAbovePlane * static_cast<double>(std::max(above, below));
}

Plane mostPopular(const PointCloud& points, const std::vector<std::uint32_t>& among, double within,
                  Random& random) {
    std::vector<std::uint32_t> counted;
    // Every so-many-th would not do: points may come in turns from table and object.
    for (const std::size_t i : randomSubset(among.size(), kCountedPoints, random))
        counted.push_back(among[i]);
    Plane best{points[among.front()], {0, 0, 1}};
    std::size_t most = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
        const auto pick = [&] { return points[among[random.below(among.size())]]; };
        const Point3 a = pick();
        const Point3 b = pick();
        const auto plane = through(a, b, pick());
        if (!plane) continue;
        const std::size_t count = countNear(points, counted, *plane, within);
        if (count > most) {
            most = count;
            best = *plane;
        }
    }
    return best;
}

std::optional<SupportPlane> findPlane(const PointCloud& points) {
    const double diagonal = boxOf(points).diagonal();
    if (!(diagonal > 0.0)) return std::nullopt;
    const double within = kCountedWithin * diagonal;
    std::vector<std::uint32_t> among(points.size());
    std::iota(among.begin(), among.end(), 0u);
    Random random(1);
    for (int i = 0; i < kPlanes && among.size() >= kFewestPoints; ++i) {
        Plane plane = mostPopular(points, among, within, random);
        for (int step = 0; step < 3; ++step) plane = fitted(points, among, plane, within);
        double squares = 0.0;
        double count = 0.0;
        for (const std::uint32_t j : among) {
            const double height = plane.height(points[j]);
            if (std::abs(height) > within) continue;
            squares += height * height;
            count += 1.0;
        }
        if (count < kLeastPlaneShare * static_cast<double>(points.size())) return std::nullopt;
        const double own =
            std::clamp(kWithinDeviations * std::sqrt(squares / count), kLeastWithin * diagonal, within);
        if (supports(points, plane, own, diagonal)) return SupportPlane{plane.point, plane.normal, own, 0};
        among.erase(
            std::remove_if(among.begin(), among.end(),
                           [&](std::uint32_t j) { return std::abs(plane.height(points[j])) <= within; }),
            among.end());
    }
    return std::nullopt;
}

// What is behind the plane does not stand on it.
bool belongsTo(const SupportPlane& plane, const Point3& p) {
    return Plane{plane.point, plane.normal}.height(p) <= plane.within;
}

// Fills `places` with the distinct points in the order of their first; returns the index of each point's
// place.
std::vector<std::uint32_t> distinctPlaces(const PointCloud& points, PointCloud& places) {
    std::vector<std::uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        if (points[a] == points[b]) return a < b;
        return lexicographicLess(points[a], points[b]);
    });
    std::vector<std::uint32_t> first(points.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool known = i > 0 && points[order[i]] == points[order[i - 1]];
        first[order[i]] = known ? first[order[i - 1]] : order[i];
    }
    std::vector<std::uint32_t> placeOf(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (first[i] == i) {
            placeOf[i] = static_cast<std::uint32_t>(places.size());
            places.push_back(points[i]);
        } else {
            placeOf[i] = placeOf[first[i]];
        }
    }
    return placeOf;
}

// The number of each group of `size` points, most points first; kNoObject of those that are too small. There
// is at least one object.
std::vector<std::int32_t> numberObjects(const std::vector<std::uint64_t>& size, std::size_t points) {
    const auto largest = static_cast<double>(*std::max_element(size.begin(), size.end()));
    const double share = std::min(kLeastObject * static_cast<double>(points), kLikeLargest * largest);
    const double least = std::min(largest, std::max(share, static_cast<double>(kFewestPoints)));
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < size.size(); ++i) {
        if (size[i] > 0 && static_cast<double>(size[i]) >= least) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return size[a] > size[b]; });
    std::vector<std::int32_t> number(size.size(), kNoObject);
    for (std::size_t k = 0; k < order.size(); ++k) number[order[k]] = static_cast<std::int32_t>(k);
    return number;
}

// Sets objects and objectOfPoint of a scene whose points on the plane are marked.
Result<void> findObjects(const PointCloud& points, Scene& scene, const RunContext& context) {
    std::vector<std::uint32_t> beside;
    PointCloud cloud;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (scene.objectOfPoint[i] == kOnPlane) continue;
        beside.push_back(i);
        cloud.push_back(points[i]);
    }
    // Between points in one place there are no gaps: each place counts once.
    PointCloud places;
    const std::vector<std::uint32_t> placeOf = distinctPlaces(cloud, places);
    if (places.size() <= kFewestPoints) {
        for (const std::uint32_t i : beside) scene.objectOfPoint[i] = 0;
        if (!beside.empty()) scene.objects = {beside.size()};
        return {};
    }
    const NeighbourIndex index(places);
    const auto around = measureReaches(places, index, context);
    RETURN_IF_ERROR(around);
    DisjointSets groups = linkedGroups(places, *around, std::vector<std::uint8_t>(places.size(), 0));
    std::vector<std::uint64_t> size(places.size(), 0);
    for (const std::uint32_t place : placeOf) ++size[groups.find(place)];
    const std::vector<std::int32_t> number = numberObjects(size, cloud.size());
    scene.objects.assign(static_cast<std::size_t>(*std::max_element(number.begin(), number.end()) + 1), 0);
    for (std::uint32_t i = 0; i < cloud.size(); ++i) {
        const std::int32_t object = number[groups.find(placeOf[i])];
        scene.objectOfPoint[beside[i]] = object;
        if (object >= 0) ++scene.objects[static_cast<std::size_t>(object)];
    }
    return {};
}

Result<Scene> sceneOf(const PointCloud& points, const RunContext& context) {
    Scene scene;
    scene.objectOfPoint.assign(points.size(), 0);
    if (points.size() < kFewestPoints) {
        if (!points.empty()) scene.objects = {points.size()};
        return scene;
    }
    scene.plane = findPlane(points);
    RETURN_IF_ERROR(context.checkpoint());
    for (std::size_t i = 0; scene.plane && i < points.size(); ++i) {
        if (!belongsTo(*scene.plane, points[i])) continue;
        scene.objectOfPoint[i] = kOnPlane;
        ++scene.plane->points;
    }
    RETURN_IF_ERROR(findObjects(points, scene, context));
    return scene;
}

// The scene of all points, given that of some of them.
Result<Scene> spread(const PointCloud& points, const PointCloud& some, Scene ofSome,
                     const RunContext& context) {
    Scene scene = std::move(ofSome);
    const std::vector<std::int32_t> known = std::exchange(scene.objectOfPoint, {});
    scene.objectOfPoint.assign(points.size(), kNoObject);
    std::fill(scene.objects.begin(), scene.objects.end(), 0);
    if (scene.plane) scene.plane->points = 0;
    const NeighbourIndex index(some);
    std::vector<Neighbour> found;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (i % 4096 == 0) RETURN_IF_ERROR(context.checkpoint());
        std::int32_t object = kOnPlane;
        if (!scene.plane || !belongsTo(*scene.plane, points[i])) {
            index.nearest(points[i], 1, found);
            object = known[found.front().point];
            // Beside the plane, but nearest to a point on it.
            if (object == kOnPlane) object = kNoObject;
        }
        scene.objectOfPoint[i] = object;
        if (object >= 0) ++scene.objects[static_cast<std::size_t>(object)];
        if (object == kOnPlane) ++scene.plane->points;
    }
    return scene;
}

template <typename Keep>
PointCloud kept(const PointCloud& points, const Scene& scene, const Keep& keep) {
    PointCloud result;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (keep(scene.objectOfPoint[i])) result.push_back(points[i]);
    }
    return result;
}

}  // namespace

Result<Scene> findScene(const PointCloud& points, const RunContext& context) {
    try {
        if (points.size() <= kMostPoints) return sceneOf(points, context);
        Random random(1);
        PointCloud some;
        some.reserve(kMostPoints);
        for (const std::size_t i : randomSubset(points.size(), kMostPoints, random))
            some.push_back(points[i]);
        auto scene = sceneOf(some, context);
        RETURN_IF_ERROR(scene);
        return spread(points, some, std::move(*scene), context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to look for a table and objects");
    }
}

PointCloud isolated(const PointCloud& points, const Scene& scene, const IsolateOptions& options) {
    return kept(points, scene, [&](std::int32_t of) { return options.keeps(of); });
}

PointCloud pointsOfObject(const PointCloud& points, const Scene& scene, std::size_t object) {
    return kept(points, scene, [&](std::int32_t of) { return of == static_cast<std::int32_t>(object); });
}

}  // namespace shapedb
