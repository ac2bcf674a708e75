// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers and tables for people; not used for JSON.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "client/api/shape_types.h"
#include "core/geometry/point.h"

namespace shapedb::cli {

/// Four significant digits, trailing zeros dropped: "0.4891", "12.5", "1.2e+09", "0".
[[nodiscard]] std::string formatNumber(double value);

/// The shortest text that reads back as the same number: "0.1", "-2.5e-07".
[[nodiscard]] std::string exactNumber(double value);

/// A fixed number of decimals: "0.489".
[[nodiscard]] std::string formatFixed(double value, int decimals);

/// Thousands separated by commas: "362,272".
[[nodiscard]] std::string formatCount(std::uint64_t count);

/// "1 shape", "3 shapes".
[[nodiscard]] std::string formatCount(std::uint64_t count, const std::string& singular,
                                      const std::string& plural);

/// "312 B", "4.0 KiB", "1.5 GiB".
[[nodiscard]] std::string formatBytes(std::uint64_t bytes);

/// "35 ms", "4.2 s", "3 min 20 s", "2 h 5 min", "3 d 4 h". Negative values count as 0.
[[nodiscard]] std::string formatSeconds(double seconds);

/// "340 a second", "1.2 a second", "4.5 a minute".
[[nodiscard]] std::string formatRate(double perSecond);

/// "42 %", "0.3 %".
[[nodiscard]] std::string formatPercent(double share);

/// "(0.1, -2, 30)".
[[nodiscard]] std::string formatPoint(const Point3& p);

/// A bar of `width` cells filled to `share` of [0, 1], in eighths: "█████▌    ".
[[nodiscard]] std::string bar(double share, int width);

/// A name or path as a part of a line: untrusted characters, line ends too, are escaped
/// (common/safe_text.h).
[[nodiscard]] std::string inLine(const std::string& name);

/// For the content or an attribute of an XML element; control characters become `?`.
[[nodiscard]] std::string escapeXml(const std::string& text);

/// Terminal columns of a UTF-8 text, counting code points (no wide or combining characters).
[[nodiscard]] std::size_t displayWidth(const std::string& text);

/// Columns padded to their widest cell, separated by two blanks, no trailing blanks.
class Table {
  public:
    enum class Align { kLeft, kRight };

    struct Column {
        std::string title;
        Align align = Align::kLeft;
    };

    explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

    /// Missing cells are empty. At most one cell per column. What a stranger may have written into a cell is
    /// escaped (common/safe_text.h), line ends too.
    void add(std::vector<std::string> cells);

    [[nodiscard]] bool empty() const { return rows_.empty(); }

    /// Starts with a line of titles unless all are empty; ends in a newline.
    [[nodiscard]] std::string render() const;

  private:
    std::vector<Column> columns_;
    std::vector<std::vector<std::string>> rows_;
};

/// UTC, as in "2026-11-29T15:04:05Z".
[[nodiscard]] std::string timeText(client::Timestamp time);

// Rows of CSV files as RFC 4180 has them, but with lines that end as on Unix.

class CsvRow {
  public:
    CsvRow& add(const std::string& cell) {
        if (!first_) line_ += ',';
        first_ = false;
        if (cell.find_first_of(",\"\r\n") == std::string::npos) {
            line_ += cell;
            return *this;
        }
        line_ += '"';
        for (const char c : cell) line_ += c == '"' ? std::string("\"\"") : std::string(1, c);
        line_ += '"';
        return *this;
    }
    CsvRow& add(const char* cell) { return add(std::string(cell)); }
    CsvRow& add(double value) { return add(exactNumber(value)); }

    [[nodiscard]] std::string line() const { return line_ + "\n"; }

  private:
    std::string line_;
    bool first_ = true;
};

}  // namespace shapedb::cli
