// Sorting by whole numbers in a time that does not depend on their order.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/large_block.h"
#include "core/base/parallel.h"

namespace shapedb {

struct KeyedIndex {
    std::uint64_t key;
    std::uint32_t index;
};

/// Sorts by rising `key`, a whole number; what has equal keys stays in order. Counts digit after digit from
/// the lowest, leaving out those in which all keys agree. Needs as much memory again. On the threads of the
/// caller's arena. May throw std::bad_alloc.
template <typename T, typename Key>
void radixSort(LargeVector<T>& elements, Key key) {
    constexpr std::uint32_t kDigitBits = 11;
    constexpr std::size_t kValues = std::size_t{1} << kDigitBits;
    constexpr std::size_t kLeastPart = 1 << 16;
    using Places = std::array<std::size_t, kValues>;
    if (elements.empty()) return;
    LargeVector<T> other(elements.size());
    const std::size_t parts = std::clamp<std::size_t>(elements.size() / kLeastPart, 1, threadsOfArena());
    std::vector<Places> places(parts);  // where the next of each digit goes, for each part
    const auto inParts = [&](const auto& work) {
        // Nothing can stop it: there is no context.
        static_cast<void>(parallelForParts(
            elements.size(), parts, {},
            [&](std::size_t part, std::size_t from, std::size_t to) { work(places[part], from, to); }));
    };
    for (std::uint32_t shift = 0; shift < 8 * sizeof(key(elements[0])); shift += kDigitBits) {
        const auto digit = [=](const T& e) {
            return static_cast<std::size_t>(key(e) >> shift) & (kValues - 1);
        };
        inParts([&](Places& counts, std::size_t from, std::size_t to) {
            counts.fill(0);
            for (std::size_t i = from; i < to; ++i) ++counts[digit(elements[i])];
        });
        std::size_t alike = 0;
        for (const Places& counts : places) alike += counts[digit(elements.front())];
        if (alike == elements.size()) continue;
        std::size_t next = 0;
        for (std::size_t v = 0; v < kValues; ++v) {
            for (Places& counts : places) next += std::exchange(counts[v], next);
        }
        inParts([&](Places& place, std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) other[place[digit(elements[i])]++] = elements[i];
        });
        elements.swap(other);
    }
}

inline void radixSortByKey(LargeVector<KeyedIndex>& keyed) {
    radixSort(keyed, [](const KeyedIndex& k) { return k.key; });
}

template <typename Number>
void radixSortNumbers(LargeVector<Number>& numbers) {
    radixSort(numbers, [](Number n) { return n; });
}

}  // namespace shapedb
