// Sorting by whole numbers in a time that does not depend on their order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace shapedb {

struct Keyed {
    std::uint64_t key = 0;
    std::uint32_t index = 0;
};

/// By rising key; what has equal keys stays in order. Counts digit after digit from the lowest, leaving out
/// those in which all keys agree. Needs as much memory again. May throw std::bad_alloc.
inline void sortByKey(std::vector<Keyed>& keyed) {
    constexpr std::uint32_t kDigitBits = 11;
    constexpr std::size_t kValues = std::size_t{1} << kDigitBits;
    std::vector<Keyed> other(keyed.size());
    for (std::uint32_t shift = 0; shift < 64; shift += kDigitBits) {
        const auto digit = [=](const Keyed& k) { return (k.key >> shift) & (kValues - 1); };
        std::array<std::size_t, kValues + 1> begin{};
        for (const Keyed& k : keyed) ++begin[digit(k) + 1];
        if (!keyed.empty() && begin[digit(keyed.front()) + 1] == keyed.size()) continue;
        for (std::size_t v = 0; v < kValues; ++v) begin[v + 1] += begin[v];
        for (const Keyed& k : keyed) other[begin[digit(k)]++] = k;
        keyed.swap(other);
    }
}

}  // namespace shapedb
