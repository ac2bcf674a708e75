// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/packed_statistics.h"

#include <algorithm>
#include <cstdlib>

#if defined(__x86_64__) && defined(__GNUC__)
#define SHAPEDB_HAS_AVX2 1
#include <immintrin.h>
#else
#define SHAPEDB_HAS_AVX2 0
#endif

#include "core/base/processor.h"

namespace shapedb {

namespace {

// Where a half keeps its statistics: five slots, three of up to 64 levels and two of up to 32, so that the
// differences of a whole statistic are summed in one or two machine instructions. The last quarter of the
// first slot of the first half, a sum of its own, is a sixth slot.
struct Slot {
    std::size_t offset;
    std::size_t bytes;
};
constexpr std::array<Slot, kKindsPerHalf> kFirstSlots{
    {{0, 24}, {32, 32}, {64, 32}, {96, 16}, {112, 16}, {24, 8}}};
constexpr std::array<Slot, kKindsInSecondHalf> kSecondSlots{
    {{0, 32}, {32, 32}, {64, 32}, {96, 16}, {112, 16}}};
constexpr std::size_t kReversibleSlot = 2;

constexpr const StatisticLayout& layoutOf(Statistic kind) {
    return kStatistics[static_cast<std::size_t>(kind)];
}

template <std::size_t kKinds>
constexpr bool fits(const std::array<Statistic, kKinds>& half, const std::array<Slot, kKinds>& slots,
                    bool mayReverse) {
    for (std::size_t s = 0; s < kKinds; ++s) {
        const StatisticLayout& layout = layoutOf(half[s]);
        if (layout.count % 2 != 0 || layout.count / 2 > slots[s].bytes) return false;
        if (layout.reversibleRows > 0 && !(mayReverse && s == kReversibleSlot)) return false;
    }
    return true;
}
static_assert(fits(kFirstHalf, kFirstSlots, false) && fits(kSecondHalf, kSecondSlots, true),
              "a statistic does not fit its slot");

constexpr bool eachIsHeldOnce() {
    std::array<int, kStatisticKinds> held{};
    for (const Statistic kind : kFirstHalf) ++held[static_cast<std::size_t>(kind)];
    for (const Statistic kind : kSecondHalf) ++held[static_cast<std::size_t>(kind)];
    for (const int times : held) {
        if (times != 1) return false;
    }
    return true;
}
static_assert(eachIsHeldOnce(), "each statistic belongs to one half");

template <std::size_t kKinds>
void packHalf(const std::uint8_t* levels, const std::array<Statistic, kKinds>& kinds,
              const std::array<Slot, kKinds>& slots, HalfRow& row) {
    HalfRow packed;  // a local one may be vectorised: nothing else points to it
    for (std::size_t s = 0; s < kKinds; ++s) {
        const StatisticLayout& layout = layoutOf(kinds[s]);
        const std::uint8_t* from = levels + layout.offset;
        std::uint8_t* to = packed.bytes.data() + slots[s].offset;
        for (std::size_t i = 0; i < layout.count / 2u; ++i) {
            const std::uint8_t low = std::min(from[2 * i], kTopLevel);
            const std::uint8_t high = std::min(from[2 * i + 1], kTopLevel);
            to[i] = static_cast<std::uint8_t>(low | (high << 4));
        }
    }
    row = packed;
}

template <std::size_t kKinds>
void unpackHalf(const HalfRow& row, const std::array<Statistic, kKinds>& kinds,
                const std::array<Slot, kKinds>& slots, std::uint8_t* levels) {
    for (std::size_t s = 0; s < kKinds; ++s) {
        const StatisticLayout& layout = layoutOf(kinds[s]);
        for (std::size_t i = 0; i < layout.count; i += 2) {
            const std::uint8_t byte = row.bytes[slots[s].offset + i / 2];
            levels[layout.offset + i] = byte & 0x0fu;
            levels[layout.offset + i + 1] = byte >> 4;
        }
    }
}

// The second half with the rows of its reversible statistic in reverse; a row is whole bytes.
HalfRow withRowsReversed(HalfRow half) {
    constexpr StatisticLayout kLayout = layoutOf(kSecondHalf[kReversibleSlot]);
    constexpr std::size_t kRowBytes = kLayout.count / kLayout.reversibleRows / 2;
    static_assert(kRowBytes * 2 * kLayout.reversibleRows == kLayout.count, "rows are not whole bytes");
    std::uint8_t* bytes = half.bytes.data() + kSecondSlots[kReversibleSlot].offset;
    for (std::size_t low = 0, high = kLayout.count / 2 - kRowBytes; low < high;
         low += kRowBytes, high -= kRowBytes) {
        std::swap_ranges(bytes + low, bytes + low + kRowBytes, bytes + high);
    }
    return half;
}

// The L1 distance of levels, which are square roots of shares (Hellinger's distance is the L2 distance of the
// roots). Roots make a rare bin that is there or not matter as much as a small change of a full one.
std::uint32_t slotSum(const HalfRow& a, const HalfRow& b, const Slot& slot) {
    std::uint32_t sum = 0;
    for (std::size_t i = slot.offset; i < slot.offset + slot.bytes; ++i) {
        sum += static_cast<std::uint32_t>(std::abs((a.bytes[i] & 0x0f) - (b.bytes[i] & 0x0f)));
        sum += static_cast<std::uint32_t>(std::abs((a.bytes[i] >> 4) - (b.bytes[i] >> 4)));
    }
    return sum;
}

template <std::size_t kKinds>
HalfSums portableSums(const HalfRow& query, const HalfRow& row, const std::array<Slot, kKinds>& slots) {
    HalfSums sums{};
    for (std::size_t s = 0; s < kKinds; ++s) sums[s] = slotSum(query, row, slots[s]);
    return sums;
}

#if SHAPEDB_HAS_AVX2

// Four partial sums of the differences of 64 levels.
SHAPEDB_WIDE inline __m256i differences(const std::uint8_t* a, const std::uint8_t* b) {
    const __m256i mask = _mm256_set1_epi8(0x0f);
    const __m256i x = _mm256_load_si256(reinterpret_cast<const __m256i*>(a));
    const __m256i y = _mm256_load_si256(reinterpret_cast<const __m256i*>(b));
    const __m256i low = _mm256_sad_epu8(_mm256_and_si256(x, mask), _mm256_and_si256(y, mask));
    // There is no shift of bytes; the mask takes away what came from the next one.
    const __m256i high = _mm256_sad_epu8(_mm256_and_si256(_mm256_srli_epi16(x, 4), mask),
                                         _mm256_and_si256(_mm256_srli_epi16(y, 4), mask));
    return _mm256_add_epi64(low, high);
}

// The sum of all four. It is at most 64 times 15, so the lower half of each is enough.
SHAPEDB_WIDE inline std::uint32_t whole(__m256i partial) {
    const __m128i halves =
        _mm_add_epi32(_mm256_castsi256_si128(partial), _mm256_extracti128_si256(partial, 1));
    return static_cast<std::uint32_t>(_mm_cvtsi128_si32(halves) + _mm_extract_epi16(halves, 4));
}

SHAPEDB_WIDE inline std::uint32_t lane(__m128i partial) {
    return static_cast<std::uint32_t>(_mm_cvtsi128_si32(partial) + _mm_extract_epi16(partial, 4));
}

// The sixth sum is that of the last quarter of the first slot. With `kSixth` it is not in the first one.
template <bool kSixth>
SHAPEDB_WIDE void wideSums(const HalfRow& query, const HalfRow* rows, std::size_t count, HalfSums* sums) {
    for (std::size_t r = 0; r < count; ++r) {
        const std::uint8_t* row = rows[r].bytes.data();
        const __m256i start = differences(query.bytes.data(), row);
        const auto quarter = static_cast<std::uint32_t>(_mm256_extract_epi16(start, 12));
        sums[r][0] = whole(start) - (kSixth ? quarter : 0);
        sums[r][5] = kSixth ? quarter : 0;
        for (std::size_t s = 1; s < 3; ++s) {
            sums[r][s] = whole(differences(query.bytes.data() + 32 * s, row + 32 * s));
        }
        const __m256i last = differences(query.bytes.data() + 96, row + 96);
        sums[r][3] = lane(_mm256_castsi256_si128(last));
        sums[r][4] = lane(_mm256_extracti128_si256(last, 1));
    }
}

SHAPEDB_WIDE std::uint32_t wideSlotSum(const HalfRow& a, const HalfRow& b) {
    return whole(differences(a.bytes.data() + 32 * kReversibleSlot, b.bytes.data() + 32 * kReversibleSlot));
}

#else

template <bool kSixth>
void wideSums(const HalfRow&, const HalfRow*, std::size_t, HalfSums*) {}
std::uint32_t wideSlotSum(const HalfRow&, const HalfRow&) { return 0; }

#endif

}  // namespace

void packStatistics(const ShapeStatistics& levels, HalfRow& first, HalfRow& second) noexcept {
    packHalf(levels.data(), kFirstHalf, kFirstSlots, first);
    packHalf(levels.data(), kSecondHalf, kSecondSlots, second);
}

void unpackStatistics(const HalfRow& first, const HalfRow& second, ShapeStatistics& levels) noexcept {
    unpackHalf(first, kFirstHalf, kFirstSlots, levels.data());
    unpackHalf(second, kSecondHalf, kSecondSlots, levels.data());
}

StatisticsDifference::StatisticsDifference(const HalfRow& first, const HalfRow& second, Instructions use)
    : first_(first),
      second_(second),
      reversed_(withRowsReversed(second)),
      wide_(use == Instructions::kBest && processorIsWide()) {}

void StatisticsDifference::first(const HalfRow* rows, std::size_t count, HalfSums* sums) const noexcept {
    if (wide_) return wideSums<true>(first_, rows, count, sums);
    for (std::size_t r = 0; r < count; ++r) sums[r] = portableSums(first_, rows[r], kFirstSlots);
}

HalfSums StatisticsDifference::second(const HalfRow& row) const noexcept {
    HalfSums sums;
    if (wide_) {
        wideSums<false>(second_, &row, 1, &sums);
        sums[kReversibleSlot] = std::min(sums[kReversibleSlot], wideSlotSum(reversed_, row));
    } else {
        sums = portableSums(second_, row, kSecondSlots);
        sums[kReversibleSlot] =
            std::min(sums[kReversibleSlot], slotSum(reversed_, row, kSecondSlots[kReversibleSlot]));
    }
    return sums;
}

}  // namespace shapedb
