// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/report_page.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "client/cli/text.h"
#include "common/safe_text.h"
#include "core/geometry/box.h"
#include "core/synthetic/degrade.h"

namespace shapedb::cli {

namespace {

constexpr const char* kStyle =
#include "client/cli/report_style.inc"
    ;
constexpr const char* kScript =
#include "client/cli/report_script.inc"
    ;

/// Nothing comes from elsewhere, and nothing goes there.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; base-uri "
    "'none'; "
    "form-action 'none'";

/// The diagonal of the query's box in the numbers of the page, which reach to 32,767.
constexpr double kDiagonal = 16384.0;
constexpr std::uint64_t kSubsetSeed = 1;

std::string base64(const std::string& bytes) {
    static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t at = 0; at < bytes.size(); at += 3) {
        std::uint32_t group = 0;
        const std::size_t size = std::min<std::size_t>(3, bytes.size() - at);
        for (std::size_t i = 0; i < 3; ++i) {
            group = group << 8 | (i < size ? static_cast<unsigned char>(bytes[at + i]) : 0u);
        }
        for (std::size_t i = 0; i < 4; ++i) {
            text += i <= size ? kDigits[group >> (18 - 6 * i) & 63u] : '=';
        }
    }
    return text;
}

/// The middle of the query is 0, its diagonal kDiagonal.
class Place {
  public:
    explicit Place(const PointCloud& query) {
        if (query.empty()) return;
        const Box box = boxOf(query);
        middle_ = 0.5 * (box.low + box.high);
        if (box.diagonal() > 0.0) scale_ = kDiagonal / box.diagonal();
    }

    /// Three 16-bit numbers a point, little-endian, in base64; without points too far away for them.
    std::string encoded(const PointCloud& points) const {
        std::string bytes;
        const PointCloud shown =
            points.size() > kMostReportPoints ? subsample(points, kMostReportPoints, kSubsetSeed) : points;
        for (const Point3& point : shown) {
            const Point3 p = scale_ * (point - middle_);
            const double numbers[] = {p.x, p.y, p.z};
            if (std::any_of(numbers, numbers + 3, [](double n) { return !(std::abs(n) < 32767.0); }))
                continue;
            for (const double number : numbers) {
                const auto bits = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(number)));
                bytes += static_cast<char>(bits & 0xffu);
                bytes += static_cast<char>(bits >> 8);
            }
        }
        return base64(bytes);
    }

  private:
    Point3 middle_;
    double scale_ = 1.0;
};

/// Escapes untrusted text for use as content or in an attribute. Line ends are kept.
std::string escaped(const std::string& text) {
    std::string out;
    std::size_t at = 0;
    while (true) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        out += escapeXml(escapeUnsafe(text.substr(at, end - at)));
        if (end == text.size()) return out;
        out += '\n';
        at = end + 1;
    }
}

std::string barCell(double share, const char* kind) {
    const double percent = 100.0 * std::clamp(share, 0.0, 1.0);
    return std::string("<span class=\"bar") + kind + "\"><span style=\"width:" + formatFixed(percent, 1) +
           "%\"></span></span>";
}

std::string hitHtml(const Place& place, const ReportHit& hit, std::size_t rank) {
    std::string text = "<article data-points=\"" + place.encoded(hit.points) +
                       "\">\n<div class=\"head\"><h2>" + std::to_string(rank) + ". " + escaped(hit.key) +
                       "</h2><span class=\"score\">" + formatFixed(hit.score, 3) + "</span></div>\n" +
                       barCell(hit.score, " main") + "\n";
    std::string facts = escaped(hit.verdict);
    if (!hit.label.empty()) facts += (facts.empty() ? "" : " · ") + escaped(hit.label);
    text += "<p class=\"facts\">" + facts +
            "</p>\n<button type=\"button\" aria-pressed=\"false\">Show</button>\n";
    if (!hit.bars.empty() || !hit.why.empty())
        text += "<details" + std::string(rank == 1 ? " open" : "") + "><summary>Why</summary>\n";
    if (!hit.bars.empty()) {
        text += "<table>\n";
        for (const ReportBar& bar : hit.bars) {
            text += "<tr><th scope=\"row\">" + escaped(bar.name) + "</th><td class=\"bars\">" +
                    barCell(bar.share, "") + "</td><td class=\"value\">" + escaped(bar.value) +
                    "</td></tr>\n";
        }
        text += "</table>\n";
    }
    if (!hit.why.empty()) text += "<p class=\"why\">" + escaped(hit.why) + "</p>\n";
    if (!hit.bars.empty() || !hit.why.empty()) text += "</details>\n";
    return text + "</article>\n";
}

}  // namespace

std::string reportHtml(const ReportPage& page) {
    const Place place(page.query);
    std::string text =
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
        std::string(kPolicy) + "\">\n<title>" + escaped(page.title) + "</title>\n<style>" + kStyle +
        "</style>\n</head>\n<body>\n<header><h1>" + escaped(page.title) + "</h1><p>" + escaped(page.about) +
        "</p></header>\n<main>\n<section aria-label=\"Hits\">\n";
    if (page.hits.empty()) text += "<p>Nothing found.</p>\n";
    for (std::size_t i = 0; i < page.hits.size(); ++i) text += hitHtml(place, page.hits[i], i + 1);
    text +=
        "</section>\n<div class=\"view\">\n<canvas tabindex=\"0\" role=\"img\" aria-label=\"The query and a "
        "hit "
        "laid on it. Arrow keys turn it, plus and minus zoom, page up and down choose a hit.\" "
        "data-points=\"" +
        place.encoded(page.query) +
        "\"></canvas>\n<div class=\"tools\"><label><input type=\"checkbox\" id=\"show-query\" checked><span "
        "class=\"swatch of-query\"></span>" +
        escaped(page.queryName) +
        "</label><label><input type=\"checkbox\" id=\"show-hit\" checked aria-label=\"the hit\"><span "
        "class=\"swatch "
        "of-hit\"></span>"
        "<span id=\"told\" role=\"status\"></span></label><button type=\"button\" id=\"reset\">Reset "
        "view</button></div>\n</div>\n</main>\n<footer>Drag to turn, wheel or two fingers to zoom. A bar of "
        "the "
        "reasons is full where the two agree.</footer>\n<script>" +
        std::string(kScript) + "</script>\n</body>\n</html>\n";
    return text;
}

}  // namespace shapedb::cli
