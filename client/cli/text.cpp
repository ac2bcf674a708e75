// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/safe_text.h"
#include "common/utc_text.h"
#include "core/base/number_text.h"

namespace shapedb::cli {

namespace {

std::string printed(const char* format, double value) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, format, value);
    return buffer;
}

}  // namespace

std::string formatNumber(double value) {
    if (value == 0.0) return "0";  // also for -0
    return printed("%.4g", value);
}

std::string exactNumber(double value) { return numberText(value); }

std::string formatFixed(double value, int decimals) {
    char buffer[400];  // the largest double has 309 digits before the point
    std::snprintf(buffer, sizeof buffer, "%.*f", decimals, value);
    return buffer;
}

std::string formatCount(std::uint64_t count) {
    std::string digits = std::to_string(count);
    for (std::size_t at = digits.size(); at > 3;) {
        at -= 3;
        digits.insert(at, 1, ',');
    }
    return digits;
}

std::string formatCount(std::uint64_t count, const std::string& singular, const std::string& plural) {
    return formatCount(count) + " " + (count == 1 ? singular : plural);
}

std::string formatBytes(std::uint64_t bytes) {
    if (bytes < 1024) return std::to_string(bytes) + " B";
    static constexpr std::array<const char*, 5> kUnits = {"KiB", "MiB", "GiB", "TiB", "PiB"};
    double value = static_cast<double>(bytes) / 1024.0;
    std::size_t unit = 0;
    while (value >= 1023.95 && unit + 1 < kUnits.size()) {  // 1023.95 would print as 1024.0
        value /= 1024.0;
        ++unit;
    }
    return formatFixed(value, 1) + " " + kUnits[unit];
}

std::string formatSeconds(double seconds) {
    if (!(seconds > 0.0)) return "0 s";
    if (seconds < 0.9995) return printed("%.3g", seconds * 1000.0) + " ms";
    if (seconds < 59.95) return printed("%.3g", seconds) + " s";
    const auto whole = static_cast<std::uint64_t>(std::llround(std::min(seconds, 1e15)));
    const auto pair = [](std::uint64_t a, const char* unitA, std::uint64_t b, const char* unitB) {
        std::string text = std::to_string(a) + " " + unitA;
        if (b > 0) text += " " + std::to_string(b) + " " + unitB;
        return text;
    };
    if (whole < 3600) return pair(whole / 60, "min", whole % 60, "s");
    if (whole < 86400) return pair(whole / 3600, "h", whole % 3600 / 60, "min");
    return pair(whole / 86400, "d", whole % 86400 / 3600, "h");
}

std::string formatRate(double perSecond) {
    if (perSecond >= 999.5)
        return formatCount(static_cast<std::uint64_t>(std::llround(perSecond))) + " a second";
    return perSecond >= 1.0 ? printed("%.3g", perSecond) + " a second"
                            : printed("%.2g", 60.0 * perSecond) + " a minute";
}

std::string formatPercent(double share) {
    const double percent = 100.0 * share;
    if (percent == 0.0) return "0 %";
    return printed(std::abs(percent) < 9.95 ? "%.2g" : "%.0f", percent) + " %";
}

std::string formatPoint(const Point3& p) {
    return "(" + formatNumber(p.x) + ", " + formatNumber(p.y) + ", " + formatNumber(p.z) + ")";
}

std::string bar(double share, int width) {
    static constexpr std::array<const char*, 8> kEighths = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
    const double clamped = std::isnan(share) ? 0.0 : std::clamp(share, 0.0, 1.0);
    const int eighths = static_cast<int>(std::lround(clamped * width * 8));
    std::string text;
    for (int i = 0; i < eighths / 8; ++i) text += "█";
    text += kEighths[static_cast<std::size_t>(eighths % 8)];
    const int used = eighths / 8 + (eighths % 8 != 0 ? 1 : 0);
    return text.append(static_cast<std::size_t>(std::max(0, width - used)), ' ');
}

std::string inLine(const std::string& name) { return escapeUnsafe(name); }

std::string escapeXml(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        switch (c) {
            case '&': escaped += "&amp;"; break;
            case '<': escaped += "&lt;"; break;
            case '>': escaped += "&gt;"; break;
            case '"': escaped += "&quot;"; break;
            // Control characters have no place in XML 1.0, not even escaped.
            default: escaped += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
        }
    }
    return escaped;
}

std::size_t displayWidth(const std::string& text) {
    return static_cast<std::size_t>(std::count_if(
        text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0u) != 0x80u; }));
}

void Table::add(std::vector<std::string> cells) {
    for (std::string& cell : cells) cell = escapeUnsafe(cell);
    rows_.push_back(std::move(cells));
}

std::string Table::render() const {
    std::vector<std::size_t> widths;
    bool titled = false;
    for (const Column& column : columns_) {
        widths.push_back(displayWidth(column.title));
        titled = titled || !column.title.empty();
    }
    for (const auto& row : rows_) {
        for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], displayWidth(row[c]));
    }

    std::string text;
    const auto line = [&](const auto& cell) {
        std::string rendered;
        for (std::size_t c = 0; c < columns_.size(); ++c) {
            const std::string content = cell(c);
            const std::string padding(widths[c] - displayWidth(content), ' ');
            if (c > 0) rendered += "  ";
            rendered += columns_[c].align == Align::kRight ? padding + content : content + padding;
        }
        rendered.erase(rendered.find_last_not_of(' ') + 1);
        text += rendered + "\n";
    };
    if (titled) line([&](std::size_t c) { return columns_[c].title; });
    for (const auto& row : rows_) {
        line([&](std::size_t c) { return c < row.size() ? row[c] : std::string(); });
    }
    return text;
}

std::string timeText(client::Timestamp time) {
    const auto seconds = std::chrono::floor<std::chrono::seconds>(time.time_since_epoch());
    return utcText(seconds.count(), "%Y-%m-%dT%H:%M:%SZ");
}

}  // namespace shapedb::cli
