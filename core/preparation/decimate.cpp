// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/decimate.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <string>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/base/spread_key.h"
#include "core/geometry/merge_duplicates.h"

namespace shapedb {

namespace {

// Finest grid: 2^20 cells along the frame's edge of 2, so that three indices fit a 64-bit key.
constexpr double kMinCell = 2.0 / (1 << 20);
// Coarsest: one cell holds everything, including the corner (1, 1, 1).
constexpr double kMaxCell = 2.5;
constexpr int kMaxSteps = 32;
constexpr int kSecantSteps = 4;
constexpr double kAcceptedShare = 0.9;
constexpr double kAimedShare = 0.96;

using CellAndPoint = std::pair<std::uint64_t, std::uint32_t>;  // cell, point

std::uint64_t cellKey(const Point3& p, double cell) {
    const auto index = [cell](double v) { return static_cast<std::uint64_t>((v + 1.0) / cell); };
    return (index(p.x) << 42) | (index(p.y) << 21) | index(p.z);
}

std::vector<CellAndPoint> sortedByCell(const PointCloud& points, double cell) {
    std::vector<CellAndPoint> keyed(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        keyed[i] = {cellKey(points[i], cell), static_cast<std::uint32_t>(i)};
    }
    std::sort(keyed.begin(), keyed.end());
    return keyed;
}

// Number of occupied cells, by a hash table with linear probing: the search for a cell size needs it many
// times, and sorting all points each time would be slower.
std::size_t countCells(const PointCloud& points, double cell) {
    constexpr std::uint64_t kFree = ~std::uint64_t{0};
    std::vector<std::uint64_t> table(1 << 12, kFree);
    std::size_t cells = 0;
    const auto slotOf = [&](std::uint64_t key) {
        std::size_t slot = spreadKey(key);
        for (slot &= table.size() - 1; table[slot] != kFree && table[slot] != key;) {
            slot = (slot + 1) & (table.size() - 1);
        }
        return slot;
    };
    for (const Point3& p : points) {
        const std::uint64_t key = cellKey(p, cell);
        const std::size_t slot = slotOf(key);
        if (table[slot] == key) continue;
        table[slot] = key;
        if (2 * ++cells <= table.size()) continue;
        std::vector<std::uint64_t> old(2 * table.size(), kFree);
        old.swap(table);
        for (const std::uint64_t known : old) {
            if (known != kFree) table[slotOf(known)] = known;
        }
    }
    return cells;
}

DecimatedPoints averageCells(const PointCloud& points, const std::vector<CellAndPoint>& keyed, double cell) {
    // Within a cell the points come by index, so sums have a fixed order.
    PointCloud means;
    std::vector<std::uint32_t> cellOfPoint(points.size());
    for (std::size_t begin = 0; begin < keyed.size();) {
        std::size_t end = begin;
        Point3 sum;
        for (; end < keyed.size() && keyed[end].first == keyed[begin].first; ++end) {
            sum = sum + points[keyed[end].second];
            cellOfPoint[keyed[end].second] = static_cast<std::uint32_t>(means.size());
        }
        means.push_back((1.0 / static_cast<double>(end - begin)) * sum);
        begin = end;
    }
    // Puts the means in lexicographic order; on a common border of two cells they may be equal.
    MergedPoints merged = mergeDuplicates(means);
    for (std::uint32_t& site : cellOfPoint) site = merged.siteOfPoint[site];
    return {std::move(merged.points), std::move(cellOfPoint), cell};
}

Result<DecimatedPoints> decimateOrThrow(const PointCloud& points, std::size_t target,
                                        const RunContext& context) {
    if (points.size() <= target) {
        MergedPoints merged = mergeDuplicates(points);
        return DecimatedPoints{std::move(merged.points), std::move(merged.siteOfPoint), 0.0};
    }
    // `fine` gives too many cells, `coarse` few enough. On a surface the number of cells falls with the
    // square of their size.
    double fine = kMinCell;
    double coarse = kMaxCell;
    double cell = std::clamp(2.0 / std::sqrt(static_cast<double>(target)), fine, coarse);
    // One cell holds everything, so there is always a size that meets the target.
    double bestCell = coarse;
    for (int step = 0; step < kMaxSteps; ++step) {
        RETURN_IF_ERROR(context.checkpoint());
        const std::size_t cells = countCells(points, cell);
        const double share = static_cast<double>(cells) / static_cast<double>(target);
        if (cells <= target) {
            coarse = cell;
            bestCell = cell;
            if (share >= kAcceptedShare || cell <= kMinCell) break;
        } else {
            fine = cell;
        }
        // Aim a little below the target. Where nearly every point has a cell of its own, the count
        // hardly depends on the size and such steps creep, so after a few every other one bisects.
        const double guess = cell * std::sqrt(share / kAimedShare);
        const bool bisect = step >= kSecantSteps && step % 2 == 0;
        // Bisects the logarithm: cell sizes span six decades.
        cell = !bisect && guess > fine && guess < coarse ? guess : std::sqrt(fine * coarse);
    }
    return averageCells(points, sortedByCell(points, bestCell), bestCell);
}

}  // namespace

Result<DecimatedPoints> decimate(const PointCloud& points, std::size_t target, const RunContext& context) {
    if (target < 4) {
        return fail(ErrorCode::kInvalidArgument, "the target of decimation must be at least 4 points");
    }
    try {
        return decimateOrThrow(points, target, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to decimate " + std::to_string(points.size()) + " points");
    }
}

}  // namespace shapedb
