// SPDX-License-Identifier: GPL-3.0-or-later
// What a user can choose about how shapes are compared.
#pragma once

#include "core/base/error.h"

namespace shapedb {

constexpr double kMinKernelWidth = 1e-6;  ///< below, single-precision positions decide by their rounding
constexpr double kMaxKernelWidth = 1e6;   ///< far beyond any shape: weights alone count

struct ScoreOptions {
    /// Also try mirrored alignments. False tells left from right.
    bool reflection = true;
    /// True compares sizes as well: shapes are not scaled to each other.
    bool keepScale = false;
    /// Scores how much of the first shape (the query) the second contains, so that a one-sided scan or
    /// a broken piece finds its whole. Not symmetric. Without keepScale the size of the piece is taken
    /// from the parts that match. Several times slower.
    bool partial = false;
    /// How far apart two points may lie and still match, in units of the shapes' common size: a pair
    /// counts for kernel(d^2, width) of its weight (kernel.h). kMinKernelWidth to kMaxKernelWidth;
    /// smaller is stricter.
    double kernelWidth = 0.1;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const ScoreOptions& options);

}  // namespace shapedb
