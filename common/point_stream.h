// SPDX-License-Identifier: Apache-2.0
// The form of points on the wire, as client and server agree on it: packed little-endian float32 x y z.
#pragma once

#include <cstddef>

namespace shapedb {

/// Bytes of one point.
constexpr std::size_t kPointBytes = 12;
/// Largest chunk of points, in bytes.
constexpr std::size_t kMaxChunkBytes = std::size_t{1} << 20;

}  // namespace shapedb
