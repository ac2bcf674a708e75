// SPDX-License-Identifier: Apache-2.0
#include "client/io/ply_header.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "client/io/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

std::optional<ScalarType> scalarTypeFromName(std::string_view word) {
    using Entry = std::pair<std::string_view, ScalarType>;
    static constexpr std::array<Entry, 19> kNames = {{{"char", ScalarType::kInt8},
                                                      {"int8", ScalarType::kInt8},
                                                      {"uchar", ScalarType::kUint8},
                                                      {"uint8", ScalarType::kUint8},
                                                      {"bool", ScalarType::kUint8},
                                                      {"short", ScalarType::kInt16},
                                                      {"int16", ScalarType::kInt16},
                                                      {"ushort", ScalarType::kUint16},
                                                      {"uint16", ScalarType::kUint16},
                                                      {"int", ScalarType::kInt32},
                                                      {"int32", ScalarType::kInt32},
                                                      {"uint", ScalarType::kUint32},
                                                      {"uint32", ScalarType::kUint32},
                                                      {"int64", ScalarType::kInt64},
                                                      {"uint64", ScalarType::kUint64},
                                                      {"float", ScalarType::kFloat32},
                                                      {"float32", ScalarType::kFloat32},
                                                      {"double", ScalarType::kFloat64},
                                                      {"float64", ScalarType::kFloat64}}};
    const std::string name = lowerCase(word);
    const auto* entry =
        std::find_if(kNames.begin(), kNames.end(), [&](const Entry& e) { return e.first == name; });
    if (entry == kNames.end()) return std::nullopt;
    return entry->second;
}

Error unknownType(const InputFile& file, std::string_view word) {
    return file.malformedLine(
        "expected a type (char uchar short ushort int uint float double, or int8 to float64), found " +
        inQuotes(word));
}

// The rest of "format ascii 1.0".
Result<PlyEncoding> parseFormat(const InputFile& file, std::string_view rest) {
    const std::string_view word = nextWord(rest);
    if (equalsIgnoringCase(word, "ascii")) return PlyEncoding::kAscii;
    if (equalsIgnoringCase(word, "binary_little_endian")) return PlyEncoding::kLittleEndian;
    if (equalsIgnoringCase(word, "binary_big_endian")) return PlyEncoding::kBigEndian;
    return fail(file.malformedLine(
        "expected format ascii, binary_little_endian or binary_big_endian, found " + inQuotes(word)));
}

// The rest of "element vertex 8".
Result<PlyElement> parseElement(const InputFile& file, std::string_view rest) {
    PlyElement element;
    element.name = lowerCase(printable(nextWord(rest)));
    const std::string_view count = nextWord(rest);
    if (element.name.empty() || !parseCount(count, element.count)) {
        return fail(file.malformedLine("expected 'element NAME COUNT', found count " + inQuotes(count)));
    }
    return element;
}

// The rest of "property float x" or "property list uchar int vertex_indices".
Result<PlyProperty> parseProperty(const InputFile& file, std::string_view rest) {
    PlyProperty property;
    std::string_view word = nextWord(rest);
    if (equalsIgnoringCase(word, "list")) {
        property.isList = true;
        word = nextWord(rest);
        const auto countType = scalarTypeFromName(word);
        if (!countType) return fail(unknownType(file, word));
        if (isFloating(*countType)) {
            return fail(file.malformedLine("expected an integer type for the length of a list, found " +
                                           inQuotes(word)));
        }
        property.countType = *countType;
        word = nextWord(rest);
    }
    const auto type = scalarTypeFromName(word);
    if (!type) return fail(unknownType(file, word));
    property.type = *type;
    property.name = printable(nextWord(rest));
    if (property.name.empty()) return fail(file.malformedLine("expected a property name, found nothing"));
    return property;
}

}  // namespace

std::optional<std::uint64_t> PlyElement::fixedSize() const {
    std::uint64_t size = 0;
    for (const PlyProperty& property : properties) {
        if (property.isList) return std::nullopt;
        size += scalarSize(property.type);
    }
    return size;
}

std::uint64_t PlyElement::leastSize(PlyEncoding encoding) const {
    // As text: a digit and the blank or line end after it.
    if (encoding == PlyEncoding::kAscii) return 2 * properties.size();
    std::uint64_t size = 0;
    for (const PlyProperty& property : properties) {
        size += scalarSize(property.isList ? property.countType : property.type);
    }
    return size;
}

Result<PlyHeader> readPlyHeader(InputFile& file) {
    file.decodeText();
    // Before reading a line: a file of another kind may have no line ends.
    const std::string_view start = file.peek(4);
    if (start.size() < 4 || !equalsIgnoringCase(start.substr(0, 3), "ply") ||
        (start[3] != '\n' && !isBlank(start[3]))) {
        return fail(file.malformed("line 1: expected 'ply'; this is not a PLY file"));
    }
    PlyHeader header;
    bool hasFormat = false;
    std::string_view line;
    file.readLine(line);
    while (file.readLine(line)) {
        const std::string keyword = lowerCase(nextWord(line));
        if (keyword == "end_header") {
            if (!hasFormat) return fail(file.malformedLine("the header has no 'format' line"));
            return header;
        }
        if (keyword == "format") {
            const auto encoding = parseFormat(file, line);
            RETURN_IF_ERROR(encoding);
            header.encoding = *encoding;
            hasFormat = true;
        } else if (keyword == "element") {
            auto element = parseElement(file, line);
            RETURN_IF_ERROR(element);
            header.elements.push_back(std::move(*element));
        } else if (keyword == "property") {
            if (header.elements.empty()) return fail(file.malformedLine("'property' before any 'element'"));
            auto property = parseProperty(file, line);
            RETURN_IF_ERROR(property);
            header.elements.back().properties.push_back(std::move(*property));
            // Blender 2.4 left out "comment" before "Created by".
        } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info" &&
                   keyword != "created") {
            return fail(file.malformedLine(
                "expected format, element, property, comment, obj_info or end_header, found " +
                inQuotes(keyword)));
        }
    }
    return fail(file.malformedLine("the file ends before 'end_header'"));
}

}  // namespace shapedb::io
