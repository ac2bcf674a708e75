// SPDX-License-Identifier: GPL-3.0-or-later
// How well one pose of the other shape explains the query, and how to improve it. For the sources of this
// folder.
#pragma once

#include <cstddef>
#include <vector>

#include "core/fit/fit.h"
#include "core/fit/fit_loops.h"
#include "core/fit/fit_points.h"
#include "core/geometry/motion.h"

namespace shapedb {

/// How the query saw the other shape.
struct FitView {
    FitKind kind = FitKind::kWhole;
    std::size_t axis = 2;  ///< one-sided: seen along this axis of the query's frame,
    float front = 1.0f;    ///< from its positive (1) or negative (-1) end
};

struct Shares {
    double query = 0.0;
    double other = 0.0;
    [[nodiscard]] double score() const;
};

/// Poses here take the other's frame (FitPoints) to the query's. Keeps scratch memory, so one per thread.
class Comparison {
  public:
    /// Both must outlive this.
    Comparison(const FitPoints& query, const FitPoints& other);

    /// From the first `points` of each set; kernel of `width`, a share of the query's diagonal.
    [[nodiscard]] Shares shares(const Motion& pose, const FitView& view, std::size_t points, float width);

    /// Steps of ICP, point to plane from both sides, by iteratively reweighted least squares: kernels from
    /// `fromWidth` down to `toWidth`.
    [[nodiscard]] Motion refined(Motion pose, const FitView& view, bool keepScale, std::size_t points,
                                 int steps, float fromWidth, float toWidth);

    /// FitPose::residual.
    [[nodiscard]] double residual(const Motion& pose, float within);

    /// Root of the mean squared distance, over the points of the other shape, between where two poses take
    /// them.
    [[nodiscard]] double apart(const Motion& a, const Motion& b) const;

    const FitPoints& query() const { return query_; }
    const FitPoints& other() const { return other_; }

  private:
    [[nodiscard]] Gauge gaugeOfOther(const Motion& pose, float width) const;
    [[nodiscard]] Gauge gaugeOfQuery(float width) const;
    const float* weighOther(const Motion& pose, const FitView& view, std::size_t count);
    void weighFront(const Motion& pose, const FitView& view, std::size_t count);

    const FitPoints& query_;
    const FitPoints& other_;
    std::vector<float> x_, y_, z_;     // query points in the other's frame
    std::vector<float> mx_, my_, mz_;  // points of the other in the query's frame
    std::vector<float> weights_;
    std::vector<float> depth_;
};

}  // namespace shapedb
