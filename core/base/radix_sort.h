// SPDX-License-Identifier: Apache-2.0
// Stable parallel radix sort by unsigned integer keys.
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

/// Sorts stably by ascending `key(element)`, an unsigned integer: digit by digit from the lowest, skipping
/// digits in which all keys agree. Needs a second array of the same size. Runs on the threads of the caller's
/// arena. May throw std::bad_alloc.
template <typename T, typename Key>
void radixSort(LargeVector<T>& elements, Key key) {
    constexpr std::uint32_t kDigitBits = 11;
    constexpr std::size_t kValues = std::size_t{1} << kDigitBits;
    constexpr std::size_t kMinPart = 1 << 16;
    using Places = std::array<std::size_t, kValues>;
    if (elements.empty()) return;
    LargeVector<T> other(elements.size());
    const std::size_t parts = std::clamp<std::size_t>(elements.size() / kMinPart, 1, threadsOfArena());
    std::vector<Places> places(parts);  // by part: where the next element of each digit goes
    const auto inParts = [&](const auto& work) {
        // Cannot fail: the default context never cancels.
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
        std::size_t agreeing = 0;
        for (const Places& counts : places) agreeing += counts[digit(elements.front())];
        if (agreeing == elements.size()) continue;
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
