// Asking for memory before it is read.
#pragma once

namespace shapedb {

/// Starts to bring the cache line at `address` near, where the compiler can say so. Any address is allowed.
inline void fetch(const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#else
    static_cast<void>(address);
#endif
}

}  // namespace shapedb
