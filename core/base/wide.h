// SPDX-License-Identifier: Apache-2.0
// Choosing, at run time, functions compiled for AVX2.
#pragma once

namespace shapedb {

/// SHAPEDB_WIDE marks a function compiled for AVX2, to be called where processorIsWide().
#if defined(__x86_64__) && defined(__GNUC__)
#define SHAPEDB_WIDE __attribute__((target("avx2")))
[[nodiscard]] inline bool processorIsWide() { return __builtin_cpu_supports("avx2") != 0; }
#else
#define SHAPEDB_WIDE
[[nodiscard]] inline bool processorIsWide() { return false; }
#endif

}  // namespace shapedb
