// Sorting by whole numbers in a time that does not depend on their order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/large_block.h"

namespace shapedb {

struct Keyed {
    std::uint64_t key;
    std::uint32_t index;
};

/// Sorts by rising `key`, a whole number; what has equal keys stays in order. Counts digit after digit from
/// the lowest, leaving out those in which all keys agree. Needs as much memory again. May throw
/// std::bad_alloc.
template <typename T, typename Key>
void sortByDigits(LargeVector<T>& elements, Key key) {
    constexpr std::uint32_t kDigitBits = 11;
    constexpr std::size_t kValues = std::size_t{1} << kDigitBits;
    LargeVector<T> other(elements.size());
    for (std::uint32_t shift = 0; shift < 8 * sizeof(key(elements[0])); shift += kDigitBits) {
        const auto digit = [=](const T& e) {
            return static_cast<std::size_t>(key(e) >> shift) & (kValues - 1);
        };
        std::array<std::size_t, kValues + 1> begin{};
        for (const T& e : elements) ++begin[digit(e) + 1];
        if (elements.empty() || begin[digit(elements.front()) + 1] == elements.size()) continue;
        for (std::size_t v = 0; v < kValues; ++v) begin[v + 1] += begin[v];
        for (const T& e : elements) other[begin[digit(e)]++] = e;
        elements.swap(other);
    }
}

inline void sortByKey(LargeVector<Keyed>& keyed) {
    sortByDigits(keyed, [](const Keyed& k) { return k.key; });
}

template <typename Number>
void sortNumbers(LargeVector<Number>& numbers) {
    sortByDigits(numbers, [](Number n) { return n; });
}

}  // namespace shapedb
