// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/chart.h"

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb::bench {
namespace {

std::size_t countOf(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

Panel panelOf(std::vector<Series> series) {
    Panel panel;
    panel.title = "a < b";
    panel.xLabel = "recall";
    panel.yLabel = "precision";
    panel.series = std::move(series);
    return panel;
}

TEST(Chart, ElementsAreClosedAndTextIsEscaped) {
    const std::string svg = drawCharts({panelOf({{"x & y", {{0.0, 0.0}, {1.0, 1.0}}, false}})}, 3);
    EXPECT_EQ(svg.find("<?xml"), 0u);
    EXPECT_EQ(countOf(svg, "<svg"), 1u);
    EXPECT_EQ(countOf(svg, "</svg>"), 1u);
    EXPECT_EQ(countOf(svg, "<g "), countOf(svg, "</g>"));
    EXPECT_EQ(countOf(svg, "<text"), countOf(svg, "</text>"));
    EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
    EXPECT_NE(svg.find("x &amp; y"), std::string::npos);
}

/// The value of an attribute in the element that starts at `at`.
std::string attribute(const std::string& svg, std::size_t at, const std::string& name) {
    const std::size_t begin = svg.find(" " + name + "=\"", at) + name.size() + 3;
    return svg.substr(begin, svg.find('"', begin) - begin);
}

struct Line {
    std::string colour;
    double width = 0.0;
    std::vector<std::pair<double, double>> points;  ///< in the picture: y grows downwards
};

std::vector<Line> linesOf(const std::string& svg) {
    std::vector<Line> lines;
    for (std::size_t at = svg.find("<polyline"); at != std::string::npos;
         at = svg.find("<polyline", at + 1)) {
        Line line{attribute(svg, at, "stroke"), std::stod(attribute(svg, at, "stroke-width")), {}};
        std::istringstream points(attribute(svg, at, "points"));
        double x = 0.0, y = 0.0;
        for (char comma = 0; points >> x >> comma >> y;) line.points.emplace_back(x, y);
        lines.push_back(std::move(line));
    }
    return lines;
}

/// The rectangle the axes enclose.
struct Area {
    double left, top, right, bottom;
};

Area plottingArea(const std::string& svg) {
    const std::size_t at = svg.find("<rect x=");
    const auto value = [&](const char* name) { return std::stod(attribute(svg, at, name)); };
    return {value("x"), value("y"), value("x") + value("width"), value("y") + value("height")};
}

TEST(Chart, ASeriesHasOneColourInAllPanelsAndOneLegendEntry) {
    const Series ours{"ours", {{0.0, 1.0}, {1.0, 0.5}}, true};
    const Series theirs{"theirs", {{0.0, 0.8}, {1.0, 0.1}}, false};
    const std::string svg = drawCharts({panelOf({ours, theirs}), panelOf({theirs, ours})}, 2);
    EXPECT_EQ(countOf(svg, ">ours</text>"), 1u);
    EXPECT_EQ(countOf(svg, ">theirs</text>"), 1u);
    const std::vector<Line> lines = linesOf(svg);
    ASSERT_EQ(lines.size(), 4u);
    // In each panel the emphasised series comes last, in front of the other, and is thicker.
    EXPECT_EQ(lines[0].colour, lines[2].colour);
    EXPECT_EQ(lines[1].colour, lines[3].colour);
    EXPECT_NE(lines[0].colour, lines[1].colour);
    EXPECT_GT(lines[1].width, lines[0].width);
    EXPECT_GT(lines[3].width, lines[2].width);
    EXPECT_EQ(attribute(svg, svg.rfind("<line", svg.find(">ours</text>")), "stroke"), lines[1].colour);
}

TEST(Chart, ValuesLieWhereTheAxesSay) {
    Panel panel = panelOf({{"line", {{0.0, 0.0}, {1.0, 0.25}}, false}});
    panel.xMax = 2.0;
    const std::string svg = drawCharts({panel}, 1);
    const Area area = plottingArea(svg);
    const Line line = linesOf(svg).at(0);
    ASSERT_EQ(line.points.size(), 2u);
    EXPECT_NEAR(line.points[0].first, area.left, 0.01);
    EXPECT_NEAR(line.points[0].second, area.bottom, 0.01);
    EXPECT_NEAR(line.points[1].first, 0.5 * (area.left + area.right), 0.01);
    EXPECT_NEAR(line.points[1].second, 0.75 * area.bottom + 0.25 * area.top, 0.01);
}

TEST(Chart, PointsOutsideAreDrawnAtTheEdge) {
    const std::string svg = drawCharts({panelOf({{"line", {{-5.0, 9.0}, {2.0, -1.0}}, false}})}, 1);
    const Area area = plottingArea(svg);
    const Line line = linesOf(svg).at(0);
    ASSERT_EQ(line.points.size(), 2u);
    EXPECT_NEAR(line.points[0].first, area.left, 0.01);
    EXPECT_NEAR(line.points[0].second, area.top, 0.01);
    EXPECT_NEAR(line.points[1].first, area.right, 0.01);
    EXPECT_NEAR(line.points[1].second, area.bottom, 0.01);
}

TEST(Chart, ManyPointsAreALineWithoutMarkers) {
    Series series{"curve", {}, false};
    for (int i = 0; i < 20; ++i) series.points.emplace_back(i / 20.0, 0.5);
    EXPECT_EQ(countOf(drawCharts({panelOf({series})}, 1), "<circle"), 0u);
    series.points.resize(3);
    EXPECT_EQ(countOf(drawCharts({panelOf({series})}, 1), "<circle"), 3u);
}

}  // namespace
}  // namespace shapedb::bench
