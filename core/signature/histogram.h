// SPDX-License-Identifier: GPL-3.0-or-later
// Histograms with soft bins: each value is shared by the two nearest bins, so that a small change
// of the shape is a small change of the histogram.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/signature/statistic_level.h"

namespace shapedb {

/// Where a value falls among n >= 2 bins over [low, high]: `bin` gets 1 - share, bin + 1 gets share. Values
/// beyond the ends belong to the end bins.
struct SoftBin {
    std::size_t bin;
    double share;
};
inline SoftBin softBin(double value, double low, double high, std::size_t n) {
    const double most = static_cast<double>(n) - 1.0;
    const double t = (value - low) / (high - low) * static_cast<double>(n) - 0.5;
    const double inside = t > 0.0 ? std::min(t, most) : 0.0;  // also for a NaN
    const std::size_t bin = std::min(static_cast<std::size_t>(inside), n - 2);
    return {bin, inside - static_cast<double>(bin)};
}

/// Rows by columns of soft bins; with one row a plain histogram.
class Histogram {
  public:
    Histogram(std::size_t rows, std::size_t columns) : columns_(columns), bins_(rows * columns, 0.0) {}

    void add(const SoftBin& column, double weight) {
        bins_[column.bin] += weight * (1.0 - column.share);
        bins_[column.bin + 1] += weight * column.share;
    }
    void add(const SoftBin& row, const SoftBin& column, double weight) {
        addInRow(row.bin, column, weight * (1.0 - row.share));
        addInRow(row.bin + 1, column, weight * row.share);
    }

    /// Writes the level of each bin's share of the sum; 0 when nothing was added.
    void writeLevels(std::uint8_t* out) const {
        double sum = 0.0;
        for (const double b : bins_) sum += b;
        for (std::size_t i = 0; i < bins_.size(); ++i) out[i] = levelOf(sum > 0.0 ? bins_[i] / sum : 0.0);
    }

  private:
    void addInRow(std::size_t row, const SoftBin& column, double weight) {
        bins_[row * columns_ + column.bin] += weight * (1.0 - column.share);
        bins_[row * columns_ + column.bin + 1] += weight * column.share;
    }

    std::size_t columns_;
    std::vector<double> bins_;
};

}  // namespace shapedb
