// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "client/cli/text.h"

namespace shapedb::bench {

namespace {

// Pixels.
constexpr double kPanelWidth = 300.0;
constexpr double kPanelHeight = 250.0;
constexpr double kLeft = 52.0;  // inside a panel, up to the axes
constexpr double kRight = 12.0;
constexpr double kTop = 28.0;
constexpr double kBottom = 42.0;
constexpr double kLegendLine = 20.0;
constexpr double kLegendEntry = 150.0;
constexpr double kMarker = 2.2;
constexpr std::size_t kMarkersUpTo = 8;  // more points than this are drawn as a line only

// Okabe and Ito (2008): distinguishable by colour-blind readers too.
constexpr std::array<const char*, 8> kColours = {"#d55e00", "#e69f00", "#0072b2", "#56b4e9",
                                                 "#009e73", "#000000", "#cc79a7", "#999999"};

std::string number(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f", value);
    return text.data();
}

std::string textAt(double x, double y, const char* attributes, const std::string& content) {
    return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + attributes + ">" +
           cli::escapeXml(content) + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& attributes) {
    return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" +
           number(y2) + "\" " + attributes + "/>\n";
}

/// Round values inside the range, about five of them.
std::vector<double> ticks(double low, double high) {
    const double rough = (high - low) / 5.0;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    double step = 10.0 * power;
    for (const double candidate : {5.0, 2.5, 2.0, 1.0}) {
        if (candidate * power >= rough) step = candidate * power;
    }
    std::vector<double> values;
    const double slack = 1e-9 * (high - low);
    for (double value = std::ceil((low - slack) / step) * step; value <= high + slack; value += step) {
        values.push_back(std::abs(value) < slack ? 0.0 : value);
    }
    return values;
}

/// Names in the order they first occur.
std::vector<std::string> legendOf(const std::vector<Panel>& panels) {
    std::vector<std::string> names;
    for (const Panel& panel : panels) {
        for (const Series& series : panel.series) {
            if (std::find(names.begin(), names.end(), series.name) == names.end()) {
                names.push_back(series.name);
            }
        }
    }
    return names;
}

/// Where a panel's values lie in its own pixels.
struct Scale {
    const Panel& panel;

    [[nodiscard]] double x(double value) const {
        const double share = std::clamp((value - panel.xMin) / (panel.xMax - panel.xMin), 0.0, 1.0);
        return kLeft + share * (kPanelWidth - kLeft - kRight);
    }
    [[nodiscard]] double y(double value) const {
        const double share = std::clamp((value - panel.yMin) / (panel.yMax - panel.yMin), 0.0, 1.0);
        return kPanelHeight - kBottom - share * (kPanelHeight - kTop - kBottom);
    }
};

std::string axes(const Panel& panel, const Scale& scale) {
    const std::string grid = "stroke=\"#dddddd\"";
    std::string svg;
    for (const double value : ticks(panel.xMin, panel.xMax)) {
        const double x = scale.x(value);
        svg += line(x, kTop, x, kPanelHeight - kBottom, grid);
        svg += textAt(x, kPanelHeight - kBottom + 14.0, "text-anchor=\"middle\"", cli::formatNumber(value));
    }
    for (const double value : ticks(panel.yMin, panel.yMax)) {
        const double y = scale.y(value);
        svg += line(kLeft, y, kPanelWidth - kRight, y, grid);
        svg += textAt(kLeft - 5.0, y + 4.0, "text-anchor=\"end\"", cli::formatNumber(value));
    }
    svg += "<rect x=\"" + number(kLeft) + "\" y=\"" + number(kTop) + "\" width=\"" +
           number(kPanelWidth - kLeft - kRight) + "\" height=\"" + number(kPanelHeight - kTop - kBottom) +
           "\" fill=\"none\" stroke=\"#666666\"/>\n";
    const double middle = 0.5 * (kLeft + kPanelWidth - kRight);
    svg += textAt(middle, kTop - 9.0, "text-anchor=\"middle\" font-weight=\"bold\"", panel.title);
    svg += textAt(middle, kPanelHeight - 10.0, "text-anchor=\"middle\"", panel.xLabel);
    svg += "<g transform=\"translate(13 " + number(0.5 * (kTop + kPanelHeight - kBottom)) +
           ") rotate(-90)\">" + textAt(0.0, 0.0, "text-anchor=\"middle\"", panel.yLabel) + "</g>\n";
    return svg;
}

std::string curve(const Series& series, const Scale& scale, const std::string& colour) {
    std::string points;
    std::string markers;
    for (const auto& [x, y] : series.points) {
        points += number(scale.x(x)) + "," + number(scale.y(y)) + " ";
        markers += "<circle cx=\"" + number(scale.x(x)) + "\" cy=\"" + number(scale.y(y)) + "\" r=\"" +
                   number(kMarker) + "\" fill=\"" + colour + "\"/>\n";
    }
    const std::string svg = "<polyline points=\"" + points + "\" fill=\"none\" stroke=\"" + colour +
                            "\" stroke-width=\"" + (series.emphasised ? "2.6" : "1.3") + "\"/>\n";
    return series.points.size() <= kMarkersUpTo ? svg + markers : svg;
}

std::string colourOf(const std::vector<std::string>& legend, const std::string& name) {
    const auto at = std::find(legend.begin(), legend.end(), name) - legend.begin();
    return kColours[static_cast<std::size_t>(at) % kColours.size()];
}

}  // namespace

std::string drawCharts(const std::vector<Panel>& panels, std::size_t columns) {
    const std::vector<std::string> legend = legendOf(panels);
    const std::size_t across = std::max<std::size_t>(1, std::min(columns, panels.size()));
    const std::size_t down = (panels.size() + across - 1) / across;
    const double width = static_cast<double>(across) * kPanelWidth;
    const auto perLine = static_cast<std::size_t>(std::max(1.0, std::floor(width / kLegendEntry)));
    const std::size_t legendLines = (legend.size() + perLine - 1) / perLine;
    const double legendTop = static_cast<double>(down) * kPanelHeight;
    const double height = legendTop + kLegendLine * (static_cast<double>(legendLines) + 0.5);

    std::string svg =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
        "width=\"" +
        number(width) + "\" height=\"" + number(height) + "\" viewBox=\"0 0 " + number(width) + " " +
        number(height) +
        "\" font-family=\"sans-serif\" font-size=\"11\">\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
    for (std::size_t i = 0; i < panels.size(); ++i) {
        const Scale scale{panels[i]};
        const std::size_t row = i / across;
        svg += "<g transform=\"translate(" + number(static_cast<double>(i % across) * kPanelWidth) + " " +
               number(static_cast<double>(row) * kPanelHeight) + ")\">\n" + axes(panels[i], scale);
        for (const bool emphasised : {false, true}) {  // those in front
            for (const Series& series : panels[i].series) {
                if (series.emphasised != emphasised) continue;
                svg += curve(series, scale, colourOf(legend, series.name));
            }
        }
        svg += "</g>\n";
    }
    for (std::size_t i = 0; i < legend.size(); ++i) {
        const double x = kLeft + static_cast<double>(i % perLine) * kLegendEntry;
        const std::size_t row = i / perLine;
        const double y = legendTop + kLegendLine * (static_cast<double>(row) + 0.5);
        svg += line(x, y, x + 22.0, y, "stroke-width=\"2.6\" stroke=\"" + colourOf(legend, legend[i]) + "\"");
        svg += textAt(x + 28.0, y + 4.0, "", legend[i]);
    }
    return svg + "</svg>\n";
}

}  // namespace shapedb::bench
