// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/cell_means.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

// Coordinates are summed as multiples of 2^-31, so that sums of up to 2^32 points are exact.
constexpr double kSumSteps = 0x1p31;

// Points are first gathered in cells of 2^-kFineBits; a coarser grid then takes each of them as a whole.
constexpr int kFineBits = 10;

// Points between two checkpoints: a few milliseconds.
constexpr std::size_t kStride = 1u << 16;

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

Result<void> keysOf(const PointCloud& points, double size, const RunContext& context,
                    std::vector<std::uint64_t>& keys) {
    keys.resize(points.size());
    return parallelFor(points.size(), kStride, context, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) keys[i] = keyOf(points[i], size);
    });
}

// Digit by digit, so that it can be stopped at any place; std::sort of a large scan takes too long for that.
Result<void> sortKeys(std::vector<std::uint64_t>& keys, const RunContext& context) {
    constexpr int kDigitBits = 11;
    constexpr std::uint64_t kMask = (std::uint64_t{1} << kDigitBits) - 1;
    std::vector<std::uint64_t> sorted(keys.size());
    for (int shift = 0; shift < 64; shift += kDigitBits) {
        std::array<std::size_t, kMask + 2> start{};
        for (std::size_t i = 0; i < keys.size(); ++i) {
            if (i % kStride == 0) RETURN_IF_ERROR(context.checkpoint());
            ++start[((keys[i] >> shift) & kMask) + 1];
        }
        for (std::size_t digit = 1; digit < start.size(); ++digit) start[digit] += start[digit - 1];
        for (std::size_t i = 0; i < keys.size(); ++i) {
            if (i % kStride == 0) RETURN_IF_ERROR(context.checkpoint());
            sorted[start[(keys[i] >> shift) & kMask]++] = keys[i];
        }
        keys.swap(sorted);
    }
    return {};
}

// Sorts the keys and leaves one of each.
Result<void> makeDistinct(std::vector<std::uint64_t>& keys, const RunContext& context) {
    RETURN_IF_ERROR(sortKeys(keys, context));
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return context.checkpoint();
}

// Groups equal keys: number of groups, and of each element its group, in order of the keys.
Result<std::size_t> group(const std::vector<std::uint64_t>& keys, const RunContext& context,
                          std::vector<std::uint32_t>& groupOf) {
    std::vector<std::uint64_t> distinct = keys;
    RETURN_IF_ERROR(makeDistinct(distinct, context));
    groupOf.resize(keys.size());
    const auto look = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            groupOf[i] = static_cast<std::uint32_t>(
                std::lower_bound(distinct.begin(), distinct.end(), keys[i]) - distinct.begin());
        }
    };
    RETURN_IF_ERROR(parallelFor(keys.size(), kStride, context, look));
    return distinct.size();
}

Result<std::size_t> distinctCells(const PointCloud& points, double size, const RunContext& context,
                                  std::vector<std::uint64_t>& keys) {
    RETURN_IF_ERROR(keysOf(points, size, context, keys));
    RETURN_IF_ERROR(makeDistinct(keys, context));
    return keys.size();
}

// The size of the finest cells, to a thousandth, of which the points take at most `most`; `small` is too
// small.
Result<double> finestSize(const PointCloud& points, std::size_t most, double small,
                          const RunContext& context) {
    double large = 2.0;
    std::vector<std::uint64_t> keys;
    for (int step = 0; step < kSizeSteps; ++step) {
        const double size = std::sqrt(small * large);
        const auto cells = distinctCells(points, size, context, keys);
        RETURN_IF_ERROR(cells);
        (*cells > most ? small : large) = size;
    }
    return large;
}

// Takes the cells, and what the points say of them, into a coarser grid of at most `most`.
Result<void> coarsen(std::vector<Gathered>& gathered, std::vector<std::uint32_t>& cellOfPoint,
                     std::size_t most, double fine, const RunContext& context) {
    PointCloud means;
    means.reserve(gathered.size());
    for (const Gathered& cell : gathered) means.push_back(cell.mean());
    const auto size = finestSize(means, most, fine, context);
    RETURN_IF_ERROR(size);
    std::vector<std::uint64_t> keys;
    RETURN_IF_ERROR(keysOf(means, *size, context, keys));
    std::vector<std::uint32_t> coarseOfFine;
    const auto cells = group(keys, context, coarseOfFine);
    RETURN_IF_ERROR(cells);
    std::vector<Gathered> coarse(*cells);
    for (std::size_t i = 0; i < gathered.size(); ++i) coarse[coarseOfFine[i]].add(gathered[i]);
    gathered = std::move(coarse);
    return parallelFor(cellOfPoint.size(), kStride, context, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) cellOfPoint[i] = coarseOfFine[cellOfPoint[i]];
    });
}

}  // namespace

Result<CellMeans> cellMeans(const PointCloud& points, std::size_t most, const RunContext& context) {
    // Far fewer bits than the sums: points closer than 2^-20 of the scan are the same point here.
    constexpr double kFinest = 0x1p-20;
    std::vector<std::uint64_t> keys;
    const auto distinct = distinctCells(points, kFinest, context, keys);
    RETURN_IF_ERROR(distinct);
    const double fine = *distinct <= most ? kFinest : std::ldexp(1.0, -kFineBits);
    RETURN_IF_ERROR(keysOf(points, fine, context, keys));
    CellMeans result;
    const auto cells = group(keys, context, result.cellOfPoint);
    RETURN_IF_ERROR(cells);
    std::vector<Gathered> gathered(*cells);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (i % kStride == 0) RETURN_IF_ERROR(context.checkpoint());
        const auto steps = [](double v) { return static_cast<std::int64_t>(std::nearbyint(kSumSteps * v)); };
        gathered[result.cellOfPoint[i]].add({steps(points[i].x), steps(points[i].y), steps(points[i].z), 1});
    }
    if (gathered.size() > most) {
        RETURN_IF_ERROR(coarsen(gathered, result.cellOfPoint, most, fine, context));
    }
    for (const Gathered& cell : gathered) result.cells.push_back({cell.mean(), cell.count});
    return result;
}

}  // namespace shapedb
