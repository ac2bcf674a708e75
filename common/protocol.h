// SPDX-License-Identifier: Apache-2.0
// What client and server agree on beside the messages of proto/.
#pragma once

#include <cstddef>

namespace shapedb {

/// Bytes of one point: packed little-endian float32 x y z.
constexpr std::size_t kPointBytes = 12;
/// Largest chunk of points, in bytes.
constexpr std::size_t kMaxChunkBytes = std::size_t{1} << 20;

/// How the status of a call shows that the server cut it off while its client was sending or reading. Such a
/// status has a code and a message of its own but no trailing metadata, in which other failures name their
/// error: the message begins with this instead, and the code stands for the error.
constexpr char kCutOffPrefix[] = "cut off by the server: ";

}  // namespace shapedb
