// SPDX-License-Identifier: GPL-3.0-or-later
// Statistics as a search reads them: two levels in a byte, in two halves, the second of which is only read
// where the first does not rule a shape out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/signature/statistics.h"

namespace shapedb {

constexpr std::size_t kHalfRowBytes = 128;

/// Half of the statistics of one shape; aligned for the widest loads.
struct alignas(32) HalfRow {
    std::array<std::uint8_t, kHalfRowBytes> bytes{};
};

/// The first half holds one more if the number of statistics is odd.
constexpr std::size_t kKindsPerHalf = (kStatisticKinds + 1) / 2;
constexpr std::size_t kKindsInSecondHalf = kStatisticKinds - kKindsPerHalf;

/// Which statistics a half holds, in the order of HalfSums. The first half was chosen to tell most
/// shapes apart.
constexpr std::array<Statistic, kKindsPerHalf> kFirstHalf{
    Statistic::kChords,  Statistic::kThicknessByCentrality, Statistic::kThicknessByRadius,
    Statistic::kBending, Statistic::kSurfaceDistances,      Statistic::kThicknessChange};
constexpr std::array<Statistic, kKindsInSecondHalf> kSecondHalf{
    Statistic::kInteriorHarmonics, Statistic::kSurfaceHarmonics, Statistic::kFootprint, Statistic::kSpread,
    Statistic::kFootprintDistances};

/// The L1 distance, in levels, of each statistic of a half; of a reversible one the smaller of both
/// orders. 0 where the second half has no statistic.
using HalfSums = std::array<std::uint32_t, kKindsPerHalf>;

/// Without loss for levels up to kTopLevel; larger ones count as kTopLevel.
void packStatistics(const ShapeStatistics& levels, HalfRow& first, HalfRow& second) noexcept;
void unpackStatistics(const HalfRow& first, const HalfRow& second, ShapeStatistics& levels) noexcept;

/// How to sum; the results are the same.
enum class Instructions {
    kBest,      ///< the best that this processor has
    kPortable,  ///< plain loops
};

/// The packed statistics of a query, prepared to be compared with many. Immutable, thread-safe.
class StatisticsDifference {
  public:
    StatisticsDifference(const HalfRow& first, const HalfRow& second, Instructions use = Instructions::kBest);

    /// The sums of each of rows[0, count), in the order of kFirstHalf.
    void first(const HalfRow* rows, std::size_t count, HalfSums* sums) const noexcept;
    /// In the order of kSecondHalf.
    [[nodiscard]] HalfSums second(const HalfRow& row) const noexcept;

  private:
    HalfRow first_, second_;
    HalfRow reversed_;  // the second half, with the rows of reversible statistics in reverse
    bool wide_;
};

}  // namespace shapedb
