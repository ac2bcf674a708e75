// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `shapedb report`: one file that needs nothing else.
#pragma once

#include <string>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb::cli {

/// A share or likeness, drawn as a bar.
struct ReportBar {
    std::string name;
    double share = 0.0;  ///< of the bar that is filled, [0, 1]
    std::string value;   ///< what stands beside it
};

struct ReportHit {
    std::string key;
    std::string label;
    double score = 0.0;
    std::string verdict;  ///< in words; may be empty
    std::string why;      ///< in words, several lines
    std::vector<ReportBar> bars;
    /// Laid on the query, in its coordinates; may be empty.
    PointCloud points;
};

struct ReportPage {
    std::string title;
    std::string about;  ///< what was searched, and when
    std::string queryName;
    PointCloud query;
    std::vector<ReportHit> hits;  ///< best first
};

/// Points of a cloud that the page shows at most.
constexpr std::size_t kMostReportPoints = 8000;

/// HTML with its styles, script and points inside, which asks the network for nothing. Words of strangers are
/// escaped. Of larger clouds it has a random subset.
[[nodiscard]] std::string reportHtml(const ReportPage& page);

}  // namespace shapedb::cli
