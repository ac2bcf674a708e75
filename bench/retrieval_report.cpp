// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/retrieval_report.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include <nlohmann/json.hpp>

#include "bench/chart.h"
#include "bench/retrieval_run.h"
#include "client/cli/text.h"

namespace shapedb::bench {

using cli::formatCount;
using cli::formatFixed;
using cli::formatNumber;
using nlohmann::json;

namespace {

constexpr const char* kUnitMethod = "d2";
constexpr std::size_t kChartColumns = 3;

struct Measure {
    const char* key;
    const char* title;
    double RetrievalMetrics::*value;
};

constexpr std::array<Measure, 5> kMeasures = {{{"nn", "NN", &RetrievalMetrics::nearestNeighbour},
                                               {"first_tier", "1st tier", &RetrievalMetrics::firstTier},
                                               {"second_tier", "2nd tier", &RetrievalMetrics::secondTier},
                                               {"dcg", "DCG", &RetrievalMetrics::dcg},
                                               {"map", "mAP", &RetrievalMetrics::averagePrecision}}};

/// A table before it is formatted.
struct Grid {
    std::vector<std::string> titles;
    std::size_t leftColumns = 1;  ///< these hold words, the others numbers
    std::vector<std::vector<std::string>> rows;
};

std::string asText(const Grid& grid) {
    std::vector<cli::Table::Column> columns;
    for (std::size_t i = 0; i < grid.titles.size(); ++i) {
        columns.push_back(
            {grid.titles[i], i < grid.leftColumns ? cli::Table::Align::kLeft : cli::Table::Align::kRight});
    }
    cli::Table table(columns);
    for (const auto& row : grid.rows) table.add(row);
    return table.render() + "\n";
}

std::string markdownRow(const std::vector<std::string>& cells) {
    std::string row = "|";
    for (const std::string& cell : cells) row += " " + cell + " |";
    return row + "\n";
}

std::string asMarkdown(const Grid& grid) {
    std::string text = markdownRow(grid.titles) + "|";
    for (std::size_t i = 0; i < grid.titles.size(); ++i) text += i < grid.leftColumns ? "---|" : "---:|";
    text += "\n";
    for (const auto& row : grid.rows) text += markdownRow(row);
    return text + "\n";
}

const MethodResult* unitOf(const LevelResult& level) {
    for (const MethodResult& method : level.methods) {
        if (method.name == kUnitMethod) return &method;
    }
    return nullptr;
}

std::string ratio(double seconds, double unit) { return unit > 0.0 ? formatNumber(seconds / unit) : "-"; }

void addTimes(std::vector<std::string>& cells, const MethodResult& method, const MethodResult* unit) {
    cells.push_back(ratio(method.secondsPerShape, unit != nullptr ? unit->secondsPerShape : 0.0));
    cells.push_back(ratio(method.secondsPerPair, unit != nullptr ? unit->secondsPerPair : 0.0));
    cells.push_back(formatCount(method.failures.size()));
}

Grid measuresGrid(const LevelResult& level, bool gallery) {
    Grid grid;
    grid.titles = {"method", "compared by"};
    grid.leftColumns = 2;
    if (gallery) {
        for (const char* title : {"hit at 1", "hit at 5", "mrr"}) grid.titles.emplace_back(title);
    } else {
        for (const Measure& measure : kMeasures) grid.titles.emplace_back(measure.title);
    }
    for (const char* title : {"describe / D2", "compare / D2", "failed"}) grid.titles.emplace_back(title);
    for (const MethodResult& method : level.methods) {
        std::vector<std::string> cells = {method.title, method.comparison};
        if (gallery) {
            const GalleryReport& report = method.gallery;
            for (const double value : {report.hitAt1, report.hitAt5, report.meanReciprocalRank}) {
                cells.push_back(formatFixed(value, 3));
            }
        } else {
            for (const Measure& measure : kMeasures) {
                cells.push_back(formatFixed(method.metrics.*measure.value, 3));
            }
        }
        addTimes(cells, method, unitOf(level));
        grid.rows.push_back(std::move(cells));
    }
    return grid;
}

/// One row per query, one column per method: rank of the right answer and first hit.
Grid ranksGrid(const LevelResult& level) {
    Grid grid;
    grid.titles = {"query"};
    grid.leftColumns = 1 + level.methods.size();
    for (const MethodResult& method : level.methods) grid.titles.push_back(method.title);
    const std::size_t queries = level.methods.empty() ? 0 : level.methods.front().queries.size();
    for (std::size_t q = 0; q < queries; ++q) {
        std::vector<std::string> cells = {level.methods.front().queries[q].query};
        for (const MethodResult& method : level.methods) {
            const QueryResult& one = method.queries[q];
            const std::string rank = one.rank > 0 ? std::to_string(one.rank) : "-";
            cells.push_back(rank + " " + std::filesystem::path(one.firstHit).stem().string());
        }
        grid.rows.push_back(std::move(cells));
    }
    return grid;
}

std::string introduction(const RetrievalReportData& data) {
    const RetrievalTask& task = data.task;
    std::string text = formatCount(task.queries.size(), "query", "queries");
    if (task.gallery.empty()) {
        std::set<std::string> classes;
        for (const cli::CollectionScan& scan : task.queries) classes.insert(scan.label);
        text += " of " + formatCount(classes.size(), "class", "classes") + ", each against all others";
    } else {
        text += " against a gallery of " + formatCount(task.gallery.size(), "shape", "shapes") +
                ", right when the " + (task.match == cli::Match::kStem ? "file name" : "folder name") +
                " is the same";
    }
    if (data.settings.scan.points) text += ", " + formatCount(*data.settings.scan.points) + " points each";
    text += data.settings.rotate ? "; every scan turned at random" : "; no scan turned";
    text += ", seed " + std::to_string(data.settings.scan.seed);
    return text;
}

std::string levelTitle(double noise) {
    return noise > 0.0 ? "noise " + formatNumber(100.0 * noise) + " % of the diagonal" : "no noise added";
}

std::string unitText(const LevelResult& level) {
    const MethodResult* unit = unitOf(level);
    if (unit == nullptr) return {};
    return "D2 describes a shape in " + formatNumber(1e3 * unit->secondsPerShape) +
           " ms and compares two in " + formatNumber(1e6 * unit->secondsPerPair) + " us.\n";
}

std::string warnings(const RetrievalReportData& data) {
    std::string text;
    if (data.peerLibrary.empty()) {
        text += "The peers of the Point Cloud Library were not built in (SHAPEDB_BENCH_PCL).\n";
    }
    if (!data.environment.optimised)
        text += "This program was built without optimisation: times mean nothing.\n";
    return text;
}

/// `render` formats a table, `heading` the title of a level.
template <typename Render, typename Heading>
std::string body(const RetrievalReportData& data, Render render, Heading heading) {
    std::string text;
    for (const LevelResult& level : data.levels) {
        const bool gallery = !data.task.gallery.empty();
        text += heading(levelTitle(level.noise)) + "\n\n" + render(measuresGrid(level, gallery));
        if (gallery) text += render(ranksGrid(level));
        text += unitText(level) + "\n";
    }
    return text;
}

json failuresJson(const std::vector<ScanFailure>& failures) {
    json list = json::array();
    for (const ScanFailure& failure : failures) {
        list.push_back({{"file", failure.path},
                        {"error", errorCodeName(failure.error.code)},
                        {"message", failure.error.message}});
    }
    return list;
}

json methodJson(const MethodResult& method, const MethodResult* unit, bool gallery) {
    json out = {{"name", method.name},
                {"comparison", method.comparison},
                {"seconds_describe", method.secondsPerShape},
                {"seconds_compare", method.secondsPerPair},
                {"failures", failuresJson(method.failures)}};
    if (unit != nullptr && unit->secondsPerShape > 0.0) {
        out["describe_per_d2"] = method.secondsPerShape / unit->secondsPerShape;
    }
    if (unit != nullptr && unit->secondsPerPair > 0.0) {
        out["compare_per_d2"] = method.secondsPerPair / unit->secondsPerPair;
    }
    if (gallery) {
        out.update({{"hit_at_1", method.gallery.hitAt1},
                    {"hit_at_5", method.gallery.hitAt5},
                    {"mrr", method.gallery.meanReciprocalRank},
                    {"queries", method.gallery.queries}});
        json ranks = json::array();
        for (const QueryResult& one : method.queries) {
            ranks.push_back({{"query", one.query},
                             {"rank", one.rank},
                             {"best", one.firstHit},
                             {"best_score", one.score}});
        }
        out["ranks"] = ranks;
    } else {
        for (const Measure& measure : kMeasures) out[measure.key] = method.metrics.*measure.value;
        out["precision_at_recall"] = method.precision;
    }
    return out;
}

/// Highlights our recommended profile.
Series seriesOf(const MethodResult& method) {
    Series series;
    series.name = method.title;
    series.emphasised = method.name == "default";
    return series;
}

Panel precisionPanel(const LevelResult& level) {
    Panel panel;
    panel.title = levelTitle(level.noise);
    panel.xLabel = "recall";
    panel.yLabel = "precision";
    for (const MethodResult& method : level.methods) {
        Series series = seriesOf(method);
        for (std::size_t i = 0; i < method.precision.size(); ++i) {
            series.points.emplace_back(static_cast<double>(i + 1) / static_cast<double>(kRecallLevels),
                                       method.precision[i]);
        }
        panel.series.push_back(std::move(series));
    }
    return panel;
}

Panel measurePanel(const std::vector<LevelResult>& levels, const Measure& measure) {
    Panel panel;
    panel.title = measure.title;
    panel.xLabel = "noise, % of the diagonal";
    double most = 0.0;
    for (const LevelResult& level : levels) most = std::max(most, 100.0 * level.noise);
    panel.xMax = most > 0.0 ? most : 1.0;
    for (std::size_t m = 0; m < levels.front().methods.size(); ++m) {
        Series series = seriesOf(levels.front().methods[m]);
        for (const LevelResult& level : levels) {
            series.points.emplace_back(100.0 * level.noise, level.methods[m].metrics.*measure.value);
        }
        std::sort(series.points.begin(), series.points.end());
        panel.series.push_back(std::move(series));
    }
    return panel;
}

}  // namespace

std::string retrievalText(const RetrievalReportData& data) {
    return introduction(data) + "\n" + describe(data.environment) +
           (data.peerLibrary.empty() ? "" : ", " + data.peerLibrary) + "\n\n" +
           body(data, asText, [](const std::string& title) { return title; }) + warnings(data);
}

std::string retrievalMarkdown(const RetrievalReportData& data) {
    return introduction(data) + ".\nMeasured " + describe(data.environment) +
           (data.peerLibrary.empty() ? "" : ", " + data.peerLibrary) + ".\n\n" +
           body(data, asMarkdown, [](const std::string& title) { return "**" + title + "**"; }) +
           warnings(data);
}

json retrievalJson(const RetrievalReportData& data) {
    const bool gallery = !data.task.gallery.empty();
    const cli::ScanFlags& scan = data.settings.scan;
    json document = {{"environment", environmentJson(data.environment)},
                     {"peers", data.peerLibrary.empty() ? json(nullptr) : json(data.peerLibrary)},
                     {"shapes", data.task.queries.size()},
                     {"seed", scan.seed},
                     {"rotated", data.settings.rotate},
                     {"points", scan.points ? json(*scan.points) : json(nullptr)},
                     {"threads", data.settings.threads}};
    if (gallery) {
        document["gallery"] = data.task.gallery.size();
        document["match"] = data.task.match == cli::Match::kStem ? "stem" : "folder";
    }
    json levels = json::array();
    for (const LevelResult& level : data.levels) {
        json methods = json::array();
        for (const MethodResult& method : level.methods) {
            methods.push_back(methodJson(method, unitOf(level), gallery));
        }
        levels.push_back({{"noise", level.noise}, {"methods", methods}});
    }
    document["levels"] = levels;
    return document;
}

std::string retrievalCharts(const std::vector<LevelResult>& levels) {
    std::vector<Panel> panels;
    for (const LevelResult& level : levels) panels.push_back(precisionPanel(level));
    if (levels.size() > 1) {
        for (const Measure& measure : kMeasures) panels.push_back(measurePanel(levels, measure));
    }
    return drawCharts(panels, kChartColumns);
}

}  // namespace shapedb::bench
