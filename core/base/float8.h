// SPDX-License-Identifier: Apache-2.0
// Eight floats computed on at once. Each lane rounds as a plain float does, so results have the same bits
// whichever registers the compiler has: two of SSE2, or one of AVX in functions compiled for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/base/processor.h"

namespace shapedb {

constexpr std::size_t kFloatLanes = 8;

#if defined(__GNUC__)
// Vector types of the compiler: + - * / and comparisons work lane by lane, a ? b : c chooses lane by lane.
typedef float Float8 __attribute__((vector_size(32)));
typedef std::int32_t Int8 __attribute__((vector_size(32)));
#else
#error "core/base/float8.h needs the vector types of g++ or clang"
#endif

/// Must be inlined, so that a caller compiled for wider registers uses them here too.
#define SHAPEDB_LANES inline __attribute__((always_inline))

SHAPEDB_LANES Float8 allLanes(float value) {
    return Float8{value, value, value, value, value, value, value, value};
}
/// From any address.
SHAPEDB_LANES Float8 loadLanes(const float* from) {
    Float8 lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
}
SHAPEDB_LANES void storeLanes(float* to, const Float8& lanes) { std::memcpy(to, &lanes, sizeof lanes); }

SHAPEDB_LANES Float8 lesser(const Float8& a, const Float8& b) { return a < b ? a : b; }
SHAPEDB_LANES Float8 greater(const Float8& a, const Float8& b) { return a > b ? a : b; }

/// In a fixed order.
SHAPEDB_LANES float sumOfLanes(const Float8& v) {
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

}  // namespace shapedb
