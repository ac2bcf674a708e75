// SPDX-License-Identifier: GPL-3.0-or-later
// The report of `shapedb-bench retrieval` as text, Markdown, JSON and a picture.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "bench/output.h"
#include "bench/retrieval_run.h"

namespace shapedb::bench {

/// What a report contains.
struct RetrievalReportData {
    const RetrievalTask& task;
    const RetrievalSettings& settings;
    const std::vector<LevelResult>& levels;
    Environment environment;
    std::string peerLibrary;  ///< empty: the peers are not built in, and the report says so
};

/// Tables with aligned columns. Times are multiples of D2's in the same run and level; "-" if
/// D2 was not measured.
[[nodiscard]] std::string retrievalText(const RetrievalReportData& data);

/// The same tables in Markdown.
[[nodiscard]] std::string retrievalMarkdown(const RetrievalReportData& data);

/// All figures, unrounded; docs/benchmarks.md lists the keys.
[[nodiscard]] nlohmann::json retrievalJson(const RetrievalReportData& data);

/// An SVG: precision over recall at each noise level, and with several levels each measure over the
/// noise. Leave-one-out only.
[[nodiscard]] std::string retrievalCharts(const std::vector<LevelResult>& levels);

}  // namespace shapedb::bench
