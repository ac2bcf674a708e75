// Asking for memory before it is read.
#pragma once

#include <cstddef>

namespace shapedb {

/// In a loop that reads memory at random: how many steps before it is read it is asked for; and what leads
/// to it.
constexpr std::size_t kPrefetchDistance = 8;
constexpr std::size_t kPrefetchFarDistance = 16;

/// Starts to bring the cache line at `address` near, where the compiler can say so. Any address is allowed.
inline void prefetch(const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#else
    static_cast<void>(address);
#endif
}

}  // namespace shapedb
