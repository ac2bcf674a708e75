// SPDX-License-Identifier: Apache-2.0
#include "client/io/pcd_header.h"

#include <string_view>
#include <utility>

#include "client/io/text.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

std::optional<ScalarType> scalarType(const PcdField& field) {
    switch (field.type) {
        case 'F':
            if (field.size == 4) return ScalarType::kFloat32;
            if (field.size == 8) return ScalarType::kFloat64;
            return std::nullopt;
        case 'I':
            if (field.size == 1) return ScalarType::kInt8;
            if (field.size == 2) return ScalarType::kInt16;
            if (field.size == 4) return ScalarType::kInt32;
            if (field.size == 8) return ScalarType::kInt64;
            return std::nullopt;
        case 'U':
            if (field.size == 1) return ScalarType::kUint8;
            if (field.size == 2) return ScalarType::kUint16;
            if (field.size == 4) return ScalarType::kUint32;
            if (field.size == 8) return ScalarType::kUint64;
            return std::nullopt;
        default: return std::nullopt;
    }
}

namespace {

constexpr std::size_t kNoField = std::numeric_limits<std::size_t>::max();

// Reads the header line by line up to and including DATA.
class HeaderParser {
  public:
    explicit HeaderParser(InputFile& file) : file_(file) {}

    Result<PcdHeader> parse() {
        std::string_view line;
        while (file_.readLine(line)) {
            std::string_view rest = withoutComment(line);
            const std::string_view word = nextWord(rest);
            if (word.empty()) continue;
            RETURN_IF_ERROR(parseLine(word, rest));
            if (equalsIgnoringCase(word, "data")) {
                RETURN_IF_ERROR(check());
                return header_;
            }
        }
        return fail(file_.malformedLine("the file ends before the DATA line of the PCD header"));
    }

  private:
    Result<void> parseLine(std::string_view word, std::string_view rest) {
        // Everybody writes them in capitals, but lower case means nothing else.
        const std::string keyword = upperCase(word);
        if (keyword == "VERSION" || keyword == "VIEWPOINT") return {};
        if (keyword == "FIELDS" || keyword == "COLUMNS") return parseFields(rest);
        if (keyword == "SIZE") return parsePerField(keyword, rest, &PcdField::size, {1, 8});
        // 0 is what PCL writes of padding that is not needed.
        if (keyword == "COUNT") {
            return parsePerField(keyword, rest, &PcdField::count,
                                 {0, std::numeric_limits<std::uint32_t>::max()});
        }
        if (keyword == "TYPE") return parseTypes(rest);
        if (keyword == "WIDTH") return parseNumber(keyword, rest, header_.width);
        if (keyword == "HEIGHT") return parseNumber(keyword, rest, header_.height);
        if (keyword == "POINTS") return parseNumber(keyword, rest, header_.points);
        if (keyword == "DATA") return parseEncoding(rest);
        return fail(
            file_.malformedLine("expected a PCD keyword (VERSION FIELDS SIZE TYPE COUNT WIDTH HEIGHT "
                                "VIEWPOINT POINTS DATA), found " +
                                inQuotes(word)));
    }

    Result<void> parseFields(std::string_view rest) {
        if (!header_.fields.empty()) return fail(file_.malformedLine("a second FIELDS line"));
        for (std::string_view name = nextWord(rest); !name.empty(); name = nextWord(rest)) {
            PcdField field;
            field.name = name;
            header_.fields.push_back(std::move(field));
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = findCoordinate(axis);
            RETURN_IF_ERROR(at);
            header_.coordinates[axis] = *at;
        }
        return {};
    }

    // A name in capitals counts if there is none in lower case.
    Result<std::size_t> findCoordinate(std::size_t axis) const {
        for (const char letter : {"xyz"[axis], "XYZ"[axis]}) {
            std::optional<std::size_t> found;
            for (std::size_t i = 0; i < header_.fields.size(); ++i) {
                if (header_.fields[i].name != std::string(1, letter)) continue;
                if (found)
                    return fail(file_.malformedLine(std::string("field '") + letter + "' appears twice"));
                found = i;
            }
            if (found) return *found;
        }
        return fail(file_.malformedLine(std::string("FIELDS has no field '") + "xyz"[axis] + "'"));
    }

    Result<void> parsePerField(std::string_view keyword, std::string_view rest,
                               std::uint64_t PcdField::*member,
                               std::pair<std::uint64_t, std::uint64_t> range) {
        for (PcdField& field : header_.fields) {
            const std::string_view word = nextWord(rest);
            std::uint64_t number = 0;
            if (!parseCount(word, number) || number < range.first || number > range.second) {
                return fail(file_.malformedLine("expected " + std::string(keyword) + " " +
                                                std::to_string(range.first) + " to " +
                                                std::to_string(range.second) + " for field " +
                                                inQuotes(field.name) + ", found " + inQuotes(word)));
            }
            field.*member = number;
        }
        return endOfPerField(keyword, rest);
    }

    Result<void> parseTypes(std::string_view rest) {
        for (PcdField& field : header_.fields) {
            const std::string_view word = nextWord(rest);
            const std::string type = upperCase(word);
            if (type != "F" && type != "I" && type != "U") {
                return fail(file_.malformedLine("expected TYPE F, I or U for field " + inQuotes(field.name) +
                                                ", found " + inQuotes(word)));
            }
            field.type = type[0];
        }
        return endOfPerField("TYPE", rest);
    }

    Result<void> endOfPerField(std::string_view keyword, std::string_view rest) {
        const std::string_view extra = nextWord(rest);
        if (extra.empty() && !header_.fields.empty()) return {};
        return fail(file_.malformedLine(std::string(keyword) +
                                        " must follow FIELDS and have one entry for each of its " +
                                        countText(header_.fields.size(), "field")));
    }

    Result<void> parseNumber(std::string_view keyword, std::string_view rest,
                             std::optional<std::uint64_t>& value) {
        const std::string_view word = nextWord(rest);
        std::uint64_t number = 0;
        if (!parseCount(word, number)) {
            return fail(file_.malformedLine("expected a number after " + std::string(keyword) + ", found " +
                                            inQuotes(word)));
        }
        value = number;
        return {};
    }

    Result<void> parseEncoding(std::string_view rest) {
        const std::string_view word = nextWord(rest);
        if (equalsIgnoringCase(word, "ascii")) {
            header_.encoding = PcdEncoding::kAscii;
        } else if (equalsIgnoringCase(word, "binary")) {
            header_.encoding = PcdEncoding::kBinary;
        } else if (equalsIgnoringCase(word, "binary_compressed")) {
            header_.encoding = PcdEncoding::kCompressed;
        } else {
            return fail(file_.malformedLine("expected DATA ascii, binary or binary_compressed, found " +
                                            inQuotes(word)));
        }
        return {};
    }

    // Checks across header lines; completes the number of points.
    Result<void> check() {
        if (header_.fields.empty()) return fail(file_.malformedLine("the header has no FIELDS line"));
        for (const std::size_t at : header_.coordinates) {
            const PcdField& field = header_.fields[at];
            if (field.count != 1 || !scalarType(field)) {
                return fail(file_.malformedLine(
                    "field '" + field.name + "' is " + std::to_string(field.count) + " x " + field.type +
                    std::to_string(field.size) + "; expected one F4, F8, I or U number"));
            }
        }
        // As PCL: a cloud without rows has one, and one without columns has all points in one row.
        std::uint64_t height = header_.height.value_or(1);
        if (height == 0 && header_.width.value_or(0) == 0 && header_.points) header_.width = header_.points;
        if (height == 0) height = 1;
        if (header_.width) {
            if (*header_.width > std::numeric_limits<std::uint64_t>::max() / height) {
                return fail(file_.malformedLine("WIDTH times HEIGHT is absurdly large"));
            }
            const std::uint64_t product = *header_.width * height;
            if (header_.points.value_or(product) != product) {
                return fail(file_.malformedLine("POINTS is " + std::to_string(*header_.points) +
                                                ", but WIDTH times HEIGHT is " + std::to_string(product)));
            }
            header_.points = product;
        }
        if (!header_.points) return fail(file_.malformedLine("the header has neither POINTS nor WIDTH"));
        return {};
    }

    InputFile& file_;
    PcdHeader header_;
};

}  // namespace

Result<PcdHeader> readPcdHeader(InputFile& file) { return HeaderParser(file).parse(); }

}  // namespace shapedb::io
