// SPDX-License-Identifier: GPL-3.0-or-later
// Line charts as SVG.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace shapedb::bench {

struct Series {
    std::string name;                               ///< the same name has the same colour in every panel
    std::vector<std::pair<double, double>> points;  ///< x, y; finite; joined in this order
    bool emphasised = false;                        ///< drawn thicker and in front
};

/// One chart. Points outside the ranges are drawn at the edge.
struct Panel {
    std::string title;
    std::string xLabel;
    std::string yLabel;
    double xMin = 0.0, xMax = 1.0;  ///< xMin < xMax
    double yMin = 0.0, yMax = 1.0;  ///< yMin < yMax
    std::vector<Series> series;
};

/// Panels row by row, `columns` (at least 1) per row; below them a legend of all series in order of first
/// use. A complete SVG document; text is escaped.
[[nodiscard]] std::string drawCharts(const std::vector<Panel>& panels, std::size_t columns);

}  // namespace shapedb::bench
