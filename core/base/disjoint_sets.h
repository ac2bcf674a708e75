// SPDX-License-Identifier: Apache-2.0
// Union-find: a partition of 0 .. count - 1 that only ever gets coarser.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace shapedb {

/// Every set has one of its members as its representative. At first each number is a set of its own.
/// Paths are halved as they are walked (Tarjan and van Leeuwen, 1984), so a call takes logarithmic time on
/// average. Not thread-safe: `find` writes too.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), 0u);
    }

    std::size_t size() const { return parent_.size(); }
    bool isRepresentative(std::uint32_t i) const { return parent_[i] == i; }

    /// The representative of the set that holds `i`.
    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    /// Makes one set of those that hold `a` and `b`; its representative is the smaller of theirs, which
    /// therefore is the smallest member as long as only `unite` is used.
    void unite(std::uint32_t a, std::uint32_t b) {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }
    /// Makes one set of two, given by their representatives; `absorbed` is one no longer.
    void absorb(std::uint32_t representative, std::uint32_t absorbed) { parent_[absorbed] = representative; }

  private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace shapedb
