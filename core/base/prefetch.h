// SPDX-License-Identifier: Apache-2.0
// Prefetching for loops that read memory in random order.
#pragma once

#include <cstddef>

namespace shapedb {

/// How many steps ahead to prefetch what a loop reads, and what it needs to compute that address.
constexpr std::size_t kPrefetchDistance = 8;
constexpr std::size_t kPrefetchFarDistance = 16;

/// Starts loading the cache line at `address`, where the compiler supports it. Any address is allowed.
inline void prefetch(const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#else
    static_cast<void>(address);
#endif
}

}  // namespace shapedb
