// SPDX-License-Identifier: GPL-3.0-or-later
// Virtual shards: the shapes of all collections in 256 parts of about the same size. A server of a cluster
// holds some of them in memory.
#pragma once

#include <bitset>
#include <chrono>
#include <cstdint>

namespace shapedb::cluster {

/// Fixed for ever: a server and the one that replaces it must agree.
constexpr int kShards = 256;

/// Those of a server, of a request, of an answer.
using ShardSet = std::bitset<kShards>;

/// Since some moment that is the same for all uses of one process; never goes back.
using Instant = std::chrono::milliseconds;

/// In [0, kShards). By a hash (splitmix64) of the id, so that shapes uploaded one after the other are spread.
/// Pinned by a test.
[[nodiscard]] constexpr int shardOf(std::int64_t shapeId) noexcept {
    std::uint64_t bits = static_cast<std::uint64_t>(shapeId) + 0x9e3779b97f4a7c15u;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
    return static_cast<int>((bits ^ (bits >> 31)) >> 56);
}

}  // namespace shapedb::cluster
