// SPDX-License-Identifier: Apache-2.0
// Plain text points: three numbers at the start of each line, or in the columns that a header names x, y and
// z.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "client/io/formats.h"
#include "client/io/text.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

bool isSeparator(char c) { return isBlank(c) || c == ',' || c == ';'; }

// The next column: columns are separated by blanks, or one comma or semicolon with blanks around it.
std::string_view nextColumn(std::string_view& rest) {
    while (!rest.empty() && isBlank(rest.front())) rest.remove_prefix(1);
    std::size_t end = 0;
    while (end < rest.size() && !isSeparator(rest[end])) ++end;
    const std::string_view column = rest.substr(0, end);
    rest.remove_prefix(end);
    while (!rest.empty() && isBlank(rest.front())) rest.remove_prefix(1);
    if (!rest.empty() && !isBlank(rest.front()) && isSeparator(rest.front())) rest.remove_prefix(1);
    return column;
}

// Does a comma stand for the decimal point? Read as a separator, "1,5 2,5 3,5" would silently
// become the point (1, 5, 2). So where blanks or semicolons part the columns, commas must not
// stand inside them.
bool hasDecimalCommas(std::string_view line) {
    bool inside = false;
    bool otherSeparator = line.find(';') != std::string_view::npos;
    const std::size_t last = line.find_last_not_of(" \t\r\v\f");
    for (std::size_t i = 1; i < line.size() && i < last; ++i) {
        const auto isInner = [](char c) { return !isSeparator(c); };
        if (line[i] == ',' && isInner(line[i - 1]) && isInner(line[i + 1])) inside = true;
        if (isBlank(line[i]) && isInner(line[i - 1])) {
            const std::size_t next = line.find_first_not_of(" \t\r\v\f", i);
            otherSeparator = otherSeparator || (next < line.size() && line[next] != ',');
        }
    }
    return inside && otherSeparator;
}

// The signs with which comments begin in one program or another.
bool isComment(std::string_view line) {
    return line.empty() || std::string_view("#;%!").find(line[0]) != std::string_view::npos ||
           line.substr(0, 2) == "//";
}

/// Where x, y and z are on a line: columns counted from 0.
struct Columns {
    std::array<std::size_t, 3> at = {0, 1, 2};
    std::size_t last = 2;
    std::size_t named = 0;  ///< in the header
};

// Tables may have quotes around names and numbers.
std::string_view withoutQuotes(std::string_view word) {
    const bool quoted = word.size() > 1 && word.front() == '"' && word.back() == '"';
    return quoted ? word.substr(1, word.size() - 2) : word;
}

// The name of a column without quotes and without its unit: "X [m]" and "x(mm)" are "x".
std::string columnName(std::string_view word) {
    while (!word.empty() && isBlank(word.front())) word.remove_prefix(1);
    while (!word.empty() && isBlank(word.back())) word.remove_suffix(1);
    word = withoutQuotes(word);
    return lowerCase(word.substr(0, word.find_first_of("[( ")));
}

// A line that names the columns, x, y and z among them.
std::optional<Columns> parseColumnNames(std::string_view line) {
    // "X [m], Y [m]": names may have blanks if something else stands between them.
    const bool marked = line.find_first_of(",;") != std::string_view::npos;
    Columns columns;
    std::array<bool, 3> found = {};
    for (std::size_t i = 0; !line.empty(); ++i) {
        const std::string_view word = marked ? line.substr(0, line.find_first_of(",;")) : nextColumn(line);
        if (marked) line.remove_prefix(std::min(word.size() + 1, line.size()));
        const std::string name = columnName(word);
        const std::size_t axis =
            name.size() == 1 ? std::string_view("xyz").find(name[0]) : std::string_view::npos;
        ++columns.named;
        if (axis == std::string_view::npos || found[axis]) continue;
        found[axis] = true;
        columns.at[axis] = i;
    }
    if (!found[0] || !found[1] || !found[2]) return std::nullopt;
    columns.last = *std::max_element(columns.at.begin(), columns.at.end());
    return columns;
}

// The names may also be a comment: "//X,Y,Z" or "# id x y z".
std::optional<Columns> columnNamesIn(std::string_view comment) {
    return parseColumnNames(comment.substr(std::min(comment.find_first_not_of("#;%!/ \t"), comment.size())));
}

std::size_t countColumns(std::string_view line) {
    std::size_t columns = 0;
    for (; !line.empty(); ++columns) nextColumn(line);
    return columns;
}

// A line that is one whole number: how many points follow.
std::optional<std::uint64_t> leadingCount(std::string_view line) {
    std::uint64_t count = 0;
    const std::string_view word = nextWord(line);
    if (!parseCount(word, count) || !nextWord(line).empty()) return std::nullopt;
    return count;
}

Result<Point3> parsePoint(const InputFile& file, std::string_view line, const Columns& columns) {
    if (line.find(',') != std::string_view::npos && hasDecimalCommas(line)) {
        return fail(file.malformedLine(
            "commas inside numbers: write decimals with a point, or separate columns with commas only"));
    }
    Point3 p;
    for (std::size_t i = 0; i <= columns.last; ++i) {
        const std::string_view column = nextColumn(line);
        double* coordinate = i == columns.at[0]   ? &p.x
                             : i == columns.at[1] ? &p.y
                             : i == columns.at[2] ? &p.z
                                                  : nullptr;
        if (coordinate != nullptr && !parseReal(withoutQuotes(column), *coordinate)) {
            return fail(
                file.malformedLine("expected three numbers x y z, found " + inQuotesNotANumber(column)));
        }
    }
    return p;
}

class XyzReader {
  public:
    explicit XyzReader(InputFile& file) : file_(file) { file_.decodeText(); }

    Result<ScanContent> read(std::size_t maxPoints) {
        ScanContent content;
        content.format = "XYZ text";
        VertexSink sink(file_, content.vertices, maxPoints);
        std::string_view line;
        while (nextPointLine(line, content.vertices.size())) {
            const auto p = parsePoint(file_, line, columns_);
            RETURN_IF_ERROR(p);
            if (!sink.add(*p)) return fail(sink.refusal(*p, "line " + std::to_string(file_.lineNumber())));
        }
        if (announced_ && *announced_ != content.vertices.size()) {
            return fail(file_.malformed("the file announces " + countText(*announced_, "point") +
                                        ", but has " + std::to_string(content.vertices.size())));
        }
        if (content.vertices.empty() && !announced_) {
            return fail(file_.malformed("no point (a line of three numbers) found"));
        }
        return content;
    }

    bool beginsWithAPoint() {
        std::string_view line;
        return nextPointLine(line, 0) && parsePoint(file_, line, columns_).has_value();
    }

  private:
    // The next line that should be a point: not a comment, a header or a count.
    bool nextPointLine(std::string_view& line, std::uint64_t points) {
        while (file_.readLine(line)) {
            while (!line.empty() && isBlank(line.front())) line.remove_prefix(1);
            if (isComment(line)) {
                if (begins_ && !line.empty()) commented_ = columnNamesIn(line);
                continue;
            }
            if (isCount(line, points)) continue;
            if (!std::exchange(begins_, false)) return true;
            if (const auto named = parseColumnNames(line)) {
                columns_ = *named;
                continue;
            }
            // A sentence with these words has another number of words than the lines have columns.
            if (commented_ && commented_->named == countColumns(line)) columns_ = *commented_;
            return true;
        }
        return false;
    }

    // The first line may be the number of points. In a file of several scans the number of the next follows
    // the last point of each.
    bool isCount(std::string_view line, std::uint64_t points) {
        const bool first = begins_ && !announced_;
        if (!first && (points == 0 || announced_ != points)) return false;
        const auto count = leadingCount(line);
        if (!count || *count > std::numeric_limits<std::uint64_t>::max() - points) return false;
        announced_ = points + *count;
        return true;
    }

    InputFile& file_;
    Columns columns_;
    std::optional<Columns> commented_;  // what a comment before the first point names
    std::optional<std::uint64_t> announced_;
    bool begins_ = true;
};

}  // namespace

Result<ScanContent> readXyz(InputFile& file, std::size_t maxPoints) {
    return XyzReader(file).read(maxPoints);
}

bool looksLikeXyz(InputFile& file) { return XyzReader(file).beginsWithAPoint(); }

}  // namespace shapedb::io
