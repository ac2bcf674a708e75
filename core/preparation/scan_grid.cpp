// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/scan_grid.h"

#include <algorithm>
#include <array>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/processor.h"
#include "core/base/radix_sort.h"
#include "core/base/return_if_error.h"
#include "core/base/spread_key.h"
#include "core/geometry/merge_duplicates.h"
#include "core/geometry/morton.h"
#include "core/preparation/decimate.h"
#include "core/preparation/sanitise.h"

namespace shapedb {

namespace {

// Points are gathered in a hash table of small cells, which is coarsened (eight cells become one) whenever
// it is full. Threads fill tables of their own for stretches of the scan, which are merged in the end. The
// final fineness is estimated from a sample first, so that little coarsening remains to be done.

// Coordinates in the unit frame, shifted to [0, 2], as integers in steps of 2^-51.
constexpr double kStepsPerUnit = 0x1p51;
constexpr int kStepBits = 52;
// The finest cells: 2^20 along the frame's edge of 2.
constexpr int kFinestBits = 20;
// Sums are kept in two parts, so that 2^32 points fit.
constexpr int kLowBits = 26;
constexpr std::uint64_t kLowMask = (std::uint64_t{1} << kLowBits) - 1;

constexpr std::size_t kCellsPerTarget = 8;
constexpr std::size_t kReadBetweenCheckpoints = 1 << 16;
// With fewer points per cell, merging a stretch costs more than filling it saves.
constexpr std::size_t kPointsPerCell = 4;
// Points per cell of the limit in the sample that tells how fine the grid will be.
constexpr std::size_t kSampledPerCell = 3;
// Bits of an axis when a cell code has 32: enough unless the points are concentrated.
constexpr int kShortCodeBits = 10;
constexpr std::uint32_t kFree = 0xffffffffu;

using Steps = std::array<std::uint64_t, 3>;

// The sum of the points of a cell, exactly.
struct Sum {
    std::array<std::uint64_t, 3> high{};
    std::array<std::uint64_t, 3> low{};
    std::uint64_t count = 0;

    void add(const Steps& steps) {
        for (std::size_t i = 0; i < 3; ++i) {
            high[i] += steps[i] >> kLowBits;
            low[i] += steps[i] & kLowMask;
        }
        ++count;
    }
    void add(const Sum& other) {
        for (std::size_t i = 0; i < 3; ++i) {
            high[i] += other.high[i];
            low[i] += other.low[i];
        }
        count += other.count;
    }
    // In the unit frame.
    Point3 mean() const {
        const auto of = [&](std::size_t i) {
            // Whole steps first: the quotient of the high part carries its remainder into the low one.
            const std::uint64_t whole = high[i] / count;
            const std::uint64_t rest = high[i] % count;
            const double fraction = (static_cast<double>(rest) * static_cast<double>(kLowMask + 1) +
                                     static_cast<double>(low[i])) /
                                    static_cast<double>(count);
            const double middle = static_cast<double>(whole << kLowBits) - kStepsPerUnit;  // exact
            return (middle + fraction) / kStepsPerUnit;
        };
        return {of(0), of(1), of(2)};
    }
};

// Index of the finest cell along an axis; the far end of the frame belongs to the last one.
std::uint64_t finestIndex(std::uint64_t steps) {
    return std::min(steps >> (kStepBits - kFinestBits), (std::uint64_t{1} << kFinestBits) - 1);
}

struct GridCell {
    std::uint64_t key = 0;
    Sum sum;
};

// The occupied cells of a grid, found by key.
class Grid {
  public:
    Grid(std::size_t limit, int bits) : limit_(limit), bits_(bits), slots_(std::size_t{1} << 12) {
        cells_.reserve(limit + 1);
    }

    // Adds points to their cells and writes the numbers of these, valid until the next coarsening, to
    // `cellOf`. Prefetches, since consecutive points may lie far apart and each would wait for memory.
    void add(const Steps* steps, std::size_t count, std::uint32_t* cellOf) {
        for (std::size_t i = 0; i < count; ++i) prefetch(&slots_[firstSlotOf(keyOf(steps[i]))]);
        for (std::size_t i = 0; i < count; ++i) {
            cellOf[i] = find(keyOf(steps[i]));
            prefetch(&cells_[cellOf[i]]);
        }
        for (std::size_t i = 0; i < count; ++i) cells_[cellOf[i]].sum.add(steps[i]);
    }
    // Adds the cells of another grid of the same fineness. Returns their numbers here.
    std::vector<std::uint32_t> add(const Grid& other) {
        return add(other.cells_, [](std::uint64_t key) { return key; });
    }
    int bits() const { return bits_; }
    bool isFull() const { return cells_.size() > limit_; }
    const std::vector<GridCell>& cells() const { return cells_; }

    // Merges cells by eight. The final fineness is the finest within the limit, which depends on all
    // points but not on their order. Returns the new number of each cell.
    std::vector<std::uint32_t> coarsen() {
        --bits_;
        std::vector<GridCell> finer;
        finer.reserve(limit_ + 1);
        finer.swap(cells_);
        std::fill(slots_.begin(), slots_.end(), Slot{});
        constexpr std::uint64_t kOneAxis = (std::uint64_t{1} << 20) - 1;
        constexpr std::uint64_t kHalves = kOneAxis << 42 | kOneAxis << 21 | kOneAxis;
        return add(finer, [](std::uint64_t key) { return key >> 1 & kHalves; });
    }

    // Sorts the cells by key, so that their order does not depend on that of the points. Returns their new
    // numbers.
    std::vector<std::uint32_t> sort() {
        LargeVector<KeyedIndex> order;
        order.reserve(cells_.size());
        for (std::uint32_t c = 0; c < cells_.size(); ++c) order.push_back({cells_[c].key, c});
        radixSortByKey(order);
        std::vector<GridCell> ordered;
        std::vector<std::uint32_t> renumbered(order.size());
        ordered.reserve(order.size());
        for (const KeyedIndex& cell : order) {
            renumbered[cell.index] = static_cast<std::uint32_t>(ordered.size());
            ordered.push_back(cells_[cell.index]);
        }
        cells_ = std::move(ordered);
        return renumbered;
    }

  private:
    struct Slot {
        std::uint64_t key = 0;
        std::uint32_t cell = kFree;
    };

    // Adds cells whose keys here are keyHere(key). Returns their numbers here.
    template <typename KeyHere>
    std::vector<std::uint32_t> add(const std::vector<GridCell>& cells, KeyHere keyHere) {
        std::vector<std::uint32_t> renumbered;
        renumbered.reserve(cells.size());
        for (const GridCell& cell : cells) {
            renumbered.push_back(find(keyHere(cell.key)));
            cells_[renumbered.back()].sum.add(cell.sum);
        }
        return renumbered;
    }

    std::uint64_t keyOf(const Steps& steps) const {
        const auto index = [this](std::uint64_t s) { return finestIndex(s) >> (kFinestBits - bits_); };
        return index(steps[0]) << 42 | index(steps[1]) << 21 | index(steps[2]);
    }

    // Where probing for a key starts.
    std::size_t firstSlotOf(std::uint64_t key) const { return spreadKey(key) & (slots_.size() - 1); }

    // Slot of the cell with this key, or the free one where it belongs. Slots hold the keys too, so that
    // most look-ups touch one cache line.
    std::size_t slotOf(std::uint64_t key) const {
        const std::size_t mask = slots_.size() - 1;
        std::size_t slot = firstSlotOf(key);
        while (slots_[slot].cell != kFree && slots_[slot].key != key) slot = (slot + 1) & mask;
        return slot;
    }

    // The cell with this key, added if necessary.
    std::uint32_t find(std::uint64_t key) {
        const std::size_t slot = slotOf(key);
        if (slots_[slot].cell != kFree) return slots_[slot].cell;
        const auto cell = static_cast<std::uint32_t>(cells_.size());
        cells_.push_back({key, {}});
        slots_[slot] = {key, cell};
        if (2 * cells_.size() > slots_.size()) {
            slots_.resize(2 * slots_.size());
            reindex();
        }
        return cell;
    }

    void reindex() {
        std::fill(slots_.begin(), slots_.end(), Slot{});
        for (std::uint32_t c = 0; c < cells_.size(); ++c) slots_[slotOf(cells_[c].key)] = {cells_[c].key, c};
    }

    std::size_t limit_;
    int bits_;
    std::vector<GridCell> cells_;
    std::vector<Slot> slots_;  // a power of two; at most half full
};

Steps stepsOf(const Point3& p, const Frame& frame, double inverse) {
    // By way of a signed integer, which is one instruction.
    const auto steps = [](double v) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>((v + 1.0) * kStepsPerUnit));
    };
    const Point3 scaled = inverse * (p - frame.centre);
    return {steps(scaled.x), steps(scaled.y), steps(scaled.z)};
}

void renumber(std::vector<std::uint32_t>& cellOfPoint, std::size_t begin, std::size_t end,
              const std::vector<std::uint32_t>& renumbered) {
    for (std::size_t i = begin; i < end; ++i) cellOfPoint[i] = renumbered[cellOfPoint[i]];
}

// A stretch of the scan in a grid of its own. Adding two gives the grid of both: sums are exact, and the
// fineness depends on the points alone.
struct Stretch {
    std::size_t begin = 0;
    std::size_t end = 0;
    Grid grid;

    void coarsen(std::vector<std::uint32_t>& cellOfPoint, std::size_t filled) {
        renumber(cellOfPoint, begin, filled, grid.coarsen());
    }

    void add(Stretch& next, std::vector<std::uint32_t>& cellOfPoint) {
        while (grid.bits() > next.grid.bits()) coarsen(cellOfPoint, end);
        while (next.grid.bits() > grid.bits()) next.coarsen(cellOfPoint, next.end);
        renumber(cellOfPoint, next.begin, next.end, grid.add(next.grid));
        end = next.end;
        while (grid.isFull()) coarsen(cellOfPoint, end);
    }
};

Result<void> fill(Stretch& stretch, const PointCloud& scan, const Frame& frame, const RunContext& context,
                  std::vector<std::uint32_t>& cellOfPoint) {
    const double inverse = 1.0 / frame.unit;  // exact: a power of two
    std::array<Steps, 32> steps;
    for (std::size_t i = stretch.begin; i < stretch.end;) {
        if ((i - stretch.begin) % kReadBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        const std::size_t count = std::min(steps.size(), stretch.end - i);
        for (std::size_t k = 0; k < count; ++k) steps[k] = stepsOf(scan[i + k], frame, inverse);
        stretch.grid.add(steps.data(), count, &cellOfPoint[i]);
        i += count;
        while (stretch.grid.isFull()) stretch.coarsen(cellOfPoint, i);
    }
    return {};
}

// Of a grid, and about how many cells it has then.
struct Fineness {
    int bits = 0;
    std::size_t cells = 0;
};

// Adds all points, one stretch per thread.
Result<Grid> fillAll(const PointCloud& scan, const Frame& frame, std::size_t limit, const Fineness& expected,
                     const RunContext& context, std::vector<std::uint32_t>& cellOfPoint) {
    const std::size_t worthwhile = scan.size() / (kPointsPerCell * expected.cells);
    const std::size_t parts = std::clamp<std::size_t>(worthwhile, 1, threadsOfArena());
    std::vector<Stretch> stretches;
    for (std::size_t k = 0; k < parts; ++k) {
        stretches.push_back(
            {k * scan.size() / parts, (k + 1) * scan.size() / parts, Grid(limit, expected.bits)});
    }
    std::vector<Result<void>> done(parts);
    const auto all = parallelFor(parts, 1, context, [&](std::size_t k, std::size_t) {
        done[k] = fill(stretches[k], scan, frame, context, cellOfPoint);
    });
    RETURN_IF_ERROR(all);
    for (const auto& result : done) {
        RETURN_IF_ERROR(result);
    }
    for (std::size_t k = 1; k < parts; ++k) stretches[0].add(stretches[k], cellOfPoint);
    return std::move(stretches[0].grid);
}

// The Morton code of each step-th point's cell in a grid of that many bits.
template <typename Code>
LargeVector<Code> cellCodes(const PointCloud& scan, const Frame& frame, std::size_t step, int bits) {
    const double inverse = 1.0 / frame.unit;
    LargeVector<Code> codes((scan.size() + step - 1) / step);
    constexpr std::size_t kBlock = 1 << 14;
    // Nothing can stop it: there is no context.
    static_cast<void>(parallelFor(codes.size(), kBlock, {}, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
            const Steps s = stepsOf(scan[i * step], frame, inverse);
            const auto code = [&](std::size_t axis) {
                return spreadBits3(finestIndex(s[axis]) >> (kFinestBits - bits));
            };
            codes[i] = static_cast<Code>(code(0) << 2 | code(1) << 1 | code(2));
        }
    }));
    return codes;
}

// The finest grid, of up to `mostBits`, in which the sample (each step-th point) occupies at most `limit`
// cells.
template <typename Code>
Fineness finestOfSample(const PointCloud& scan, const Frame& frame, std::size_t limit, std::size_t step,
                        int mostBits) {
    static_assert(std::is_unsigned_v<Code>);
    LargeVector<Code> codes = cellCodes<Code>(scan, frame, step, mostBits);
    radixSortNumbers(codes);
    // Neighbours in sorted order share a cell down to the level of their highest differing bit.
    std::array<std::size_t, kFinestBits + 1> splits{};
    for (std::size_t i = 1; i < codes.size(); ++i) {
        const Code differing = codes[i] ^ codes[i - 1];
        int level = mostBits;
        for (Code rest = differing >> 3; rest != 0; rest >>= 3) --level;
        if (differing != 0) ++splits[static_cast<std::size_t>(level)];
    }
    Fineness finest{0, 1};
    while (finest.bits < mostBits) {
        const std::size_t finer = finest.cells + splits[static_cast<std::size_t>(finest.bits) + 1];
        if (finer > limit) break;
        finest = {finest.bits + 1, finer};
    }
    return finest;
}

// The fineness to begin with, at least the final one: all points occupy at least as many cells as a sample
// of them, so their finest grid within the limit is no finer than the sample's.
Fineness finestToTry(const PointCloud& scan, const Frame& frame, std::size_t limit) {
    const std::size_t step = std::max<std::size_t>(1, scan.size() / (kSampledPerCell * limit));
    const auto finest = finestOfSample<std::uint32_t>(scan, frame, limit, step, kShortCodeBits);
    if (finest.bits < kShortCodeBits) return finest;
    return finestOfSample<std::uint64_t>(scan, frame, limit, step, kFinestBits);
}

Result<std::optional<GriddedScan>> gridScanOrThrow(const PointCloud& scan, std::size_t target,
                                                   const RunContext& context) {
    const auto frame = frameOf(scan);
    RETURN_IF_ERROR(frame);
    const std::size_t limit = kCellsPerTarget * target;
    std::vector<std::uint32_t> siteOfPoint(scan.size());
    auto grid = fillAll(scan, *frame, limit, finestToTry(scan, *frame, limit), context, siteOfPoint);
    RETURN_IF_ERROR(grid);
    if (grid->cells().size() <= target) return std::optional<GriddedScan>();
    const std::vector<std::uint32_t> sorted = grid->sort();
    const std::vector<GridCell>& small = grid->cells();
    PointCloud means;
    means.reserve(small.size());
    for (const GridCell& cell : small) means.push_back(cell.sum.mean());
    RETURN_IF_ERROR(checkNotFlat(means));
    const auto large = decimate(means, target, context);
    RETURN_IF_ERROR(large);
    // decimate took every small cell for one point. The sums weigh each with the number of its points.
    std::vector<Sum> sums(large->points.size());
    for (std::size_t c = 0; c < small.size(); ++c) sums[large->siteOfPoint[c]].add(small[c].sum);
    PointCloud weighted;
    weighted.reserve(sums.size());
    for (const Sum& sum : sums) weighted.push_back(sum.mean());
    MergedPoints merged = mergeDuplicates(weighted);
    std::vector<std::uint32_t> siteOfCell(small.size());
    for (std::size_t c = 0; c < small.size(); ++c) {
        // siteOfPoint still has the numbers from before sorting.
        siteOfCell[c] = merged.siteOfPoint[large->siteOfPoint[sorted[c]]];
    }
    renumber(siteOfPoint, 0, scan.size(), siteOfCell);
    return std::optional<GriddedScan>(GriddedScan{std::move(merged.points), std::move(siteOfPoint), *frame});
}

}  // namespace

Result<std::optional<GriddedScan>> gridScan(const PointCloud& scan, std::size_t target,
                                            const RunContext& context) {
    try {
        return gridScanOrThrow(scan, target, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to decimate " + std::to_string(scan.size()) + " points");
    }
}

}  // namespace shapedb
