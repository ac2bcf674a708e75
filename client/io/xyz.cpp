// Plain text points: three numbers at the start of each line (.xyz .txt .pts .asc).
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "client/io/formats.h"
#include "client/io/text.h"
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

bool isComment(std::string_view line) { return line.empty() || line[0] == '#' || line.substr(0, 2) == "//"; }

// A line that only names the columns: x, y, z and perhaps more.
bool namesColumns(std::string_view line) {
    for (const std::string_view name : {"x", "y", "z"}) {
        std::string_view column = nextColumn(line);
        if (column.size() == 3 && column.front() == '"' && column.back() == '"') column = column.substr(1, 1);
        if (!equalsIgnoringCase(column, name)) return false;
    }
    return true;
}

// A line that is one whole number: how many points follow.
std::optional<std::uint64_t> leadingCount(std::string_view line) {
    std::uint64_t count = 0;
    const std::string_view word = nextWord(line);
    if (!parseCount(word, count) || !nextWord(line).empty()) return std::nullopt;
    return count;
}

bool nextContentLine(InputFile& file, std::string_view& line) {
    while (file.readLine(line)) {
        while (!line.empty() && isBlank(line.front())) line.remove_prefix(1);
        if (!isComment(line)) return true;
    }
    return false;
}

Result<Point3> parsePoint(const InputFile& file, std::string_view line) {
    if (line.find(',') != std::string_view::npos && hasDecimalCommas(line)) {
        return fail(file.malformedLine(
            "commas inside numbers: write decimals with a point, or separate columns with commas only"));
    }
    Point3 p;
    for (double* coordinate : {&p.x, &p.y, &p.z}) {
        const std::string_view column = nextColumn(line);
        if (!parseReal(column, *coordinate)) {
            return fail(file.malformedLine("expected three numbers x y z, found " + inQuotes(column)));
        }
    }
    return p;
}

}  // namespace

Result<ScanContent> readXyz(InputFile& file, std::size_t maxPoints) {
    ScanContent content;
    content.format = "XYZ text";
    VertexSink sink(file, content.vertices, maxPoints);
    std::optional<std::uint64_t> announced;
    bool first = true;
    std::string_view line;
    file.skipByteOrderMark();
    while (nextContentLine(file, line)) {
        if (first) {
            first = false;
            announced = leadingCount(line);
            if (announced || namesColumns(line)) continue;
        }
        const auto p = parsePoint(file, line);
        RETURN_IF_ERROR(p);
        if (!sink.add(*p)) return fail(sink.refusal(*p, "line " + std::to_string(file.lineNumber())));
    }
    if (announced && *announced != content.vertices.size()) {
        return fail(file.malformed("the first line announces " + std::to_string(*announced) +
                                   " points, but the file has " + std::to_string(content.vertices.size())));
    }
    if (content.vertices.empty() && !announced) {
        return fail(file.malformed("no point (a line of three numbers) found"));
    }
    return content;
}

bool looksLikeXyz(InputFile& file) {
    std::string_view line;
    file.skipByteOrderMark();
    if (!nextContentLine(file, line)) return false;
    if ((leadingCount(line) || namesColumns(line)) && !nextContentLine(file, line)) return false;
    return parsePoint(file, line).has_value();
}

}  // namespace shapedb::io
