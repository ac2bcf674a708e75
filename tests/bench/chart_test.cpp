#include "bench/chart.h"

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

TEST(Chart, ASeriesHasOneColourInAllPanelsAndOneLegendEntry) {
    const Series ours{"ours", {{0.0, 1.0}, {1.0, 0.5}}, true};
    const Series theirs{"theirs", {{0.0, 0.8}, {1.0, 0.1}}, false};
    const std::string svg = drawCharts({panelOf({ours, theirs}), panelOf({theirs, ours})}, 2);
    EXPECT_EQ(countOf(svg, "<polyline"), 4u);
    EXPECT_EQ(countOf(svg, ">ours</text>"), 1u);
    EXPECT_EQ(countOf(svg, ">theirs</text>"), 1u);
    EXPECT_EQ(countOf(svg, "fill=\"none\" stroke=\"#d55e00\" stroke-width=\"2.6\""), 2u) << "emphasised";
    EXPECT_EQ(countOf(svg, "fill=\"none\" stroke=\"#e69f00\" stroke-width=\"1.3\""), 2u);
}

TEST(Chart, ValuesLieWhereTheAxesSay) {
    Panel panel = panelOf({{"line", {{0.0, 0.0}, {1.0, 1.0}}, false}});
    panel.xMax = 2.0;
    // The corners of the plotting area are its rectangle's.
    const std::string svg = drawCharts({panel}, 1);
    EXPECT_NE(svg.find("<polyline points=\"52.00,208.00 170.00,28.00 \""), std::string::npos) << svg;
}

TEST(Chart, PointsOutsideAreDrawnAtTheEdge) {
    const std::string svg = drawCharts({panelOf({{"line", {{-5.0, 9.0}, {2.0, -1.0}}, false}})}, 1);
    EXPECT_NE(svg.find("<polyline points=\"52.00,28.00 288.00,208.00 \""), std::string::npos) << svg;
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
