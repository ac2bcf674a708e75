// Decimating a large scan as it streams by: no copy and no sorting of its points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/preparation/sanitise.h"

namespace shapedb {

struct GriddedScan {
    PointCloud points;                       ///< distinct, in the unit frame, in lexicographic order
    std::vector<std::uint32_t> siteOfPoint;  ///< point of the scan -> index into `points`
    Frame frame;
};

/// What `sanitise` and then `decimate` do, for scans of far more than `target` points: one mean per
/// occupied cell of a cubic grid, at most `target`, usually at least nine tenths of that. Differences:
/// a point that repeats another counts as often as it comes, and points are first gathered in small cells
/// (at most eight times `target` of them) that go to the cell of the grid their mean lies in.
///
/// The sums are exact, so the order of the points leaves no trace, nor does the number of threads (those of
/// the caller's arena). Memory besides the result: about 100 bytes for each small cell, for every thread,
/// whatever the size of the scan. Time linear in the scan.
///
/// Nothing when the scan occupies so few cells that its distinct points may be fewer than `target`: then
/// use `sanitise`. Errors: those of `sanitise` (flatness is judged by the small cells' means); kCancelled,
/// kDeadlineExceeded.
[[nodiscard]] Result<std::optional<GriddedScan>> gridScan(const PointCloud& scan, std::size_t target,
                                                          const RunContext& context = {});

}  // namespace shapedb
