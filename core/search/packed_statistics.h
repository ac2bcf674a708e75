// Statistics as a search reads them: levels two in a byte, arranged so that the differences of a
// whole statistic are summed in one or two machine instructions, in two halves of which the second
// is only looked at where the first leaves hope.
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

constexpr std::size_t kKindsPerHalf = kStatisticKinds / 2;

/// Which statistics a half holds, in the order in which HalfSums counts them. The first half was
/// chosen to tell most shapes apart.
constexpr std::array<Statistic, kKindsPerHalf> kFirstHalf{
    Statistic::kChords, Statistic::kThicknessByCentrality, Statistic::kThicknessByRadius, Statistic::kBending,
    Statistic::kSurfaceDistances};
constexpr std::array<Statistic, kKindsPerHalf> kSecondHalf{
    Statistic::kInteriorHarmonics, Statistic::kSurfaceHarmonics, Statistic::kFootprint, Statistic::kSpread,
    Statistic::kFootprintDistances};

/// Sums of differences of levels between two shapes, for each statistic of a half; a reversible
/// statistic's in the better sense.
using HalfSums = std::array<std::uint32_t, kKindsPerHalf>;

/// Levels above kTopLevel are cut off.
void packStatistics(const ShapeStatistics& levels, HalfRow& first, HalfRow& second) noexcept;
void unpackStatistics(const HalfRow& first, const HalfRow& second, ShapeStatistics& levels) noexcept;

/// How to sum; the results are the same.
enum class Instructions {
    kBest,      ///< what this processor offers
    kPortable,  ///< plain loops
};

/// A query's statistics, prepared for differences against many. Immutable, thread-safe.
class StatisticsDifference {
  public:
    explicit StatisticsDifference(const ShapeStatistics& query, Instructions use = Instructions::kBest);

    /// Of rows[0, count) each; in the order of kFirstHalf and kSecondHalf.
    void first(const HalfRow* rows, std::size_t count, HalfSums* sums) const noexcept;
    [[nodiscard]] HalfSums second(const HalfRow& row) const noexcept;

  private:
    HalfRow first_, second_;
    HalfRow reversed_;  // the second half, where rows of reversible statistics are in reverse
    bool wide_;
};

}  // namespace shapedb
