#include "core/fit/cell_means.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace shapedb {

namespace {

// Coordinates are summed as multiples of 2^-31, so that sums of up to 2^32 points are exact.
constexpr double kSumSteps = 0x1p31;

// Points are first gathered in cells of 2^-kFineBits; a coarser grid then takes each of them as a whole.
constexpr int kFineBits = 10;

// Halvings of the range of the cells' size: to less than a thousandth of it.
constexpr int kSizeSteps = 14;

struct Gathered {
    std::int64_t x = 0;
    std::int64_t y = 0;
    std::int64_t z = 0;
    std::uint64_t count = 0;

    void add(const Gathered& other) {
        x += other.x;
        y += other.y;
        z += other.z;
        count += other.count;
    }
    Point3 mean() const {
        const double scale = 1.0 / (kSumSteps * static_cast<double>(count));
        return {scale * static_cast<double>(x), scale * static_cast<double>(y),
                scale * static_cast<double>(z)};
    }
};

std::uint64_t keyOf(const Point3& p, double size) {
    const auto cell = [&](double v) { return static_cast<std::uint64_t>(std::floor((v + 1.0) / size)); };
    return (cell(p.x) << 42) | (cell(p.y) << 21) | cell(p.z);
}

// Groups equal keys: number of groups, and of each element its group, in order of the keys.
std::size_t group(const std::vector<std::uint64_t>& keys, std::vector<std::uint32_t>& groupOf) {
    std::vector<std::uint64_t> sorted = keys;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    groupOf.resize(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
        groupOf[i] = static_cast<std::uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), keys[i]) -
                                                sorted.begin());
    }
    return sorted.size();
}

std::size_t distinctCells(const PointCloud& points, double size, std::vector<std::uint64_t>& keys) {
    keys.clear();
    for (const Point3& p : points) keys.push_back(keyOf(p, size));
    std::sort(keys.begin(), keys.end());
    return static_cast<std::size_t>(std::unique(keys.begin(), keys.end()) - keys.begin());
}

}  // namespace

CellMeans cellMeans(const PointCloud& points, std::size_t most) {
    // Far fewer bits than the sums: points closer than 2^-20 of the scan are the same point here.
    constexpr double kFinest = 0x1p-20;
    std::vector<std::uint64_t> keys;
    const bool few = distinctCells(points, kFinest, keys) <= most;
    const double fine = few ? kFinest : std::ldexp(1.0, -kFineBits);
    keys.clear();
    for (const Point3& p : points) keys.push_back(keyOf(p, fine));
    std::vector<std::uint32_t> fineOfPoint;
    std::vector<Gathered> gathered(group(keys, fineOfPoint));
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto steps = [](double v) { return static_cast<std::int64_t>(std::nearbyint(kSumSteps * v)); };
        gathered[fineOfPoint[i]].add({steps(points[i].x), steps(points[i].y), steps(points[i].z), 1});
    }
    CellMeans result;
    result.cellOfPoint = fineOfPoint;
    if (gathered.size() > most) {
        PointCloud means;
        for (const Gathered& cell : gathered) means.push_back(cell.mean());
        double small = fine;
        double large = 2.0;
        for (int step = 0; step < kSizeSteps; ++step) {
            const double size = std::sqrt(small * large);
            (distinctCells(means, size, keys) > most ? small : large) = size;
        }
        keys.clear();
        for (const Point3& p : means) keys.push_back(keyOf(p, large));
        std::vector<std::uint32_t> coarseOfFine;
        std::vector<Gathered> coarse(group(keys, coarseOfFine));
        for (std::size_t i = 0; i < gathered.size(); ++i) coarse[coarseOfFine[i]].add(gathered[i]);
        gathered = std::move(coarse);
        for (std::uint32_t& cell : result.cellOfPoint) cell = coarseOfFine[cell];
    }
    for (const Gathered& cell : gathered) result.cells.push_back({cell.mean(), cell.count});
    return result;
}

}  // namespace shapedb
