// SPDX-License-Identifier: GPL-3.0-or-later
// Where to start: poses from laying principal axes on each other, judged by a few points. For the sources of
// this folder.
#pragma once

#include <cstddef>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/comparison.h"
#include "core/geometry/motion.h"

namespace shapedb {

struct Hypothesis {
    Motion pose;  ///< from the other's frame (FitPoints) to the query's
    FitView view;
};

/// The `count` most promising poses of one kind, best first, ties in a fixed order.
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<Hypothesis>> promisingPoses(const FitPoints& query, const FitPoints& other,
                                                             FitKind kind, const FitOptions& options,
                                                             std::size_t count, const RunContext& context);

}  // namespace shapedb
