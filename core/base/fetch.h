// Asking for memory before it is read.
#pragma once

#include <cstddef>

namespace shapedb {

/// In a loop that reads memory at random: how many steps before it is read it is asked for; and what leads
/// to it.
constexpr std::size_t kFetchAhead = 8;
constexpr std::size_t kFetchFarAhead = 16;

/// Starts to bring the cache line at `address` near, where the compiler can say so. Any address is allowed.
inline void fetch(const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#else
    static_cast<void>(address);
#endif
}

}  // namespace shapedb
