// SPDX-License-Identifier: GPL-3.0-or-later
// A sample of the points of a scan, enough to look at it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/random.h"

namespace shapedb::catalog {

/// At most `most` of `total` points (0: all), spread evenly over their order. A pure function of the two
/// numbers.
///
/// Scanners write points line by line: every n-th would show stripes. So one of each n is taken by chance.
class EvenSample {
  public:
    EvenSample(std::uint64_t total, std::uint64_t most)
        : total_(total), size_(most == 0 ? total : std::min(most, total)) {}

    [[nodiscard]] std::size_t size() const { return size_; }
    /// The index of the i-th point of the sample, in [i, total); rises with i.
    [[nodiscard]] std::size_t at(std::size_t i) const {
        if (size_ == total_) return i;
        const std::uint64_t first = i * total_ / size_;
        const std::uint64_t end = (i + 1) * total_ / size_;
        return first + Random(i).below(end - first);
    }

  private:
    std::uint64_t total_;
    std::uint64_t size_;
};

}  // namespace shapedb::catalog
