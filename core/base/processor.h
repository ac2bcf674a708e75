// SPDX-License-Identifier: Apache-2.0
// What is written for the processor: prefetching in loops that read memory in random order, and functions
// compiled for AVX2, chosen at run time.
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

/// SHAPEDB_WIDE marks a function compiled for AVX2, to be called where processorIsWide().
#if defined(__x86_64__) && defined(__GNUC__)
#define SHAPEDB_WIDE __attribute__((target("avx2")))
[[nodiscard]] inline bool processorIsWide() { return __builtin_cpu_supports("avx2") != 0; }
#else
#define SHAPEDB_WIDE
[[nodiscard]] inline bool processorIsWide() { return false; }
#endif

}  // namespace shapedb
