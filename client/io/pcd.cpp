// PCD (Point Cloud Library): ASCII, binary and binary_compressed.
//
// A point with a coordinate that is not finite means "nothing measured here": it is skipped and counted.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lzf.h>

#include "client/io/formats.h"
#include "client/io/scalar.h"
#include "client/io/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

constexpr std::size_t kNoField = std::numeric_limits<std::size_t>::max();

// LZF writes at most 264 bytes (its longest back reference) for 3 bytes read.
constexpr std::uint64_t kLzfGreatestRatio = 88;

struct PcdField {
    std::string name;
    std::uint64_t size = 4;
    char type = 'F';
    std::uint64_t count = 1;

    std::uint64_t bytes() const { return size * count; }
    // Padding before the next field.
    bool isPadding() const { return name == "_"; }
};

enum class PcdEncoding { kAscii, kBinary, kCompressed };

struct PcdHeader {
    std::vector<PcdField> fields;
    std::optional<std::uint64_t> width;
    std::optional<std::uint64_t> height;
    std::optional<std::uint64_t> points;
    PcdEncoding encoding = PcdEncoding::kAscii;
    std::array<std::size_t, 3> coordinates = {kNoField, kNoField, kNoField};  ///< fields named x, y, z

    std::uint64_t bytesPerPoint(bool withPadding) const {
        std::uint64_t sum = 0;
        for (const PcdField& field : fields) {
            if (withPadding || !field.isPadding()) sum += field.bytes();
        }
        return sum;
    }
};

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

// Reads the header line by line up to and including DATA.
class HeaderParser {
  public:
    explicit HeaderParser(InputFile& file) : file_(file) {}

    Result<PcdHeader> parse() {
        std::string_view line;
        while (file_.readLine(line)) {
            std::string_view rest = withoutComment(line);
            const std::string_view keyword = nextWord(rest);
            if (keyword.empty()) continue;
            RETURN_IF_ERROR(parseLine(keyword, rest));
            if (keyword == "DATA") {
                RETURN_IF_ERROR(check());
                return header_;
            }
        }
        return fail(file_.malformedLine("the file ends before the DATA line of the PCD header"));
    }

  private:
    Result<void> parseLine(std::string_view keyword, std::string_view rest) {
        if (keyword == "VERSION" || keyword == "VIEWPOINT") return {};
        if (keyword == "FIELDS" || keyword == "COLUMNS") return parseFields(rest);
        if (keyword == "SIZE") return parsePerField(keyword, rest, &PcdField::size, 8);
        if (keyword == "COUNT") {
            return parsePerField(keyword, rest, &PcdField::count, std::numeric_limits<std::uint32_t>::max());
        }
        if (keyword == "TYPE") return parseTypes(rest);
        if (keyword == "WIDTH") return parseNumber(keyword, rest, header_.width);
        if (keyword == "HEIGHT") return parseNumber(keyword, rest, header_.height);
        if (keyword == "POINTS") return parseNumber(keyword, rest, header_.points);
        if (keyword == "DATA") return parseEncoding(rest);
        return fail(
            file_.malformedLine("expected a PCD keyword (VERSION FIELDS SIZE TYPE COUNT WIDTH HEIGHT "
                                "VIEWPOINT POINTS DATA), found " +
                                inQuotes(keyword)));
    }

    Result<void> parseFields(std::string_view rest) {
        if (!header_.fields.empty()) return fail(file_.malformedLine("a second FIELDS line"));
        for (std::string_view name = nextWord(rest); !name.empty(); name = nextWord(rest)) {
            PcdField field;
            field.name = name;
            if (name == "x" || name == "y" || name == "z") {
                std::size_t& place = header_.coordinates[static_cast<std::size_t>(name[0] - 'x')];
                if (place != kNoField)
                    return fail(file_.malformedLine("field " + inQuotes(name) + " appears twice"));
                place = header_.fields.size();
            }
            header_.fields.push_back(std::move(field));
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (header_.coordinates[axis] == kNoField) {
                return fail(file_.malformedLine(std::string("FIELDS has no field '") + "xyz"[axis] + "'"));
            }
        }
        return {};
    }

    Result<void> parsePerField(std::string_view keyword, std::string_view rest,
                               std::uint64_t PcdField::*member, std::uint64_t greatest) {
        for (PcdField& field : header_.fields) {
            const std::string_view word = nextWord(rest);
            std::uint64_t number = 0;
            if (!parseCount(word, number) || number == 0 || number > greatest) {
                return fail(file_.malformedLine("expected " + std::string(keyword) + " 1 to " +
                                                std::to_string(greatest) + " for field " +
                                                inQuotes(field.name) + ", found " + inQuotes(word)));
            }
            field.*member = number;
        }
        return endOfPerField(keyword, rest);
    }

    Result<void> parseTypes(std::string_view rest) {
        for (PcdField& field : header_.fields) {
            const std::string_view word = nextWord(rest);
            if (word != "F" && word != "I" && word != "U") {
                return fail(file_.malformedLine("expected TYPE F, I or U for field " + inQuotes(field.name) +
                                                ", found " + inQuotes(word)));
            }
            field.type = word[0];
        }
        return endOfPerField("TYPE", rest);
    }

    Result<void> endOfPerField(std::string_view keyword, std::string_view rest) {
        const std::string_view extra = nextWord(rest);
        if (extra.empty() && !header_.fields.empty()) return {};
        return fail(file_.malformedLine(std::string(keyword) +
                                        " must follow FIELDS and have one entry for each of its " +
                                        std::to_string(header_.fields.size()) + " fields"));
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
        if (word == "ascii") {
            header_.encoding = PcdEncoding::kAscii;
        } else if (word == "binary") {
            header_.encoding = PcdEncoding::kBinary;
        } else if (word == "binary_compressed") {
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
        const std::uint64_t height = header_.height.value_or(1);
        if (header_.width) {
            if (height != 0 && *header_.width > std::numeric_limits<std::uint64_t>::max() / height) {
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

class PcdBody {
  public:
    PcdBody(InputFile& file, const PcdHeader& header, ScanContent& content, std::size_t maxPoints)
        : file_(file), header_(header), content_(content), sink_(file, content.vertices, maxPoints) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            type_[axis] = *scalarType(header.fields[header.coordinates[axis]]);
        }
    }

    Result<void> read() {
        switch (header_.encoding) {
            case PcdEncoding::kAscii: return readAscii();
            case PcdEncoding::kBinary: return readBinary();
            case PcdEncoding::kCompressed: return readCompressed();
        }
        return {};
    }

  private:
    std::uint64_t count() const { return *header_.points; }

    bool add(const Point3& p) {
        if (isFinite(p)) return sink_.add(p);
        ++content_.skippedNonFinite;
        return true;
    }

    Result<void> readAscii() {
        // A line of n numbers takes at least 2n bytes.
        if (const auto left = file_.remaining()) sink_.reserve(std::min(count(), *left / 6));
        std::string_view line;
        for (std::uint64_t i = 0; i < count();) {
            if (!file_.readLine(line)) {
                return fail(file_.malformed("the file ends after line " + std::to_string(file_.lineNumber()) +
                                            ": the header announces " + std::to_string(count()) +
                                            " points, found " + std::to_string(i)));
            }
            if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
            RETURN_IF_ERROR(readAsciiPoint(line));
            ++i;
        }
        if (file_.onlyPaddingLeft()) return {};
        return fail(file_.malformedByte(
            file_.offset(), "data after the last of the announced " + std::to_string(count()) + " points"));
    }

    Result<void> readAsciiPoint(std::string_view line) {
        std::array<double, 3> value = {};
        for (std::size_t f = 0; f < header_.fields.size(); ++f) {
            const auto* axis = std::find(header_.coordinates.begin(), header_.coordinates.end(), f);
            for (std::uint64_t c = 0; c < header_.fields[f].count; ++c) {
                const std::string_view word = nextWord(line);
                const bool good =
                    axis != header_.coordinates.end()
                        ? parseReal(word, value[static_cast<std::size_t>(axis - header_.coordinates.begin())])
                        : !word.empty();
                if (!good) {
                    return fail(file_.malformedLine("expected a number for field " +
                                                    inQuotes(header_.fields[f].name) + ", found " +
                                                    inQuotes(word)));
                }
            }
        }
        if (const std::string_view extra = nextWord(line); !extra.empty()) {
            return fail(
                file_.malformedLine("expected the line end after the last field, found " + inQuotes(extra)));
        }
        const Point3 p = {value[0], value[1], value[2]};
        if (!add(p)) return fail(sink_.refusal(p, "line " + std::to_string(file_.lineNumber())));
        return {};
    }

    Result<void> readBinary() {
        const std::uint64_t size = header_.bytesPerPoint(true);
        if (const auto left = file_.remaining()) {
            if (count() > *left / size) {
                return fail(tooShort("the header announces " + std::to_string(count()) + " points of " +
                                     std::to_string(size) + " bytes, but the file has room for " +
                                     std::to_string(*left / size)));
            }
            sink_.reserve(count());
        }
        std::array<std::uint64_t, 3> offset = {};
        for (std::size_t axis = 0; axis < 3; ++axis)
            offset[axis] = bytesBefore(header_.coordinates[axis], true);
        const std::uint64_t start = file_.offset();
        Point3 p;
        const std::uint64_t done = visitRecords(file_, count(), size, [&](const char* record, auto) {
            p = load(record + offset[0], record + offset[1], record + offset[2]);
            return add(p);
        });
        if (done == count()) return {};
        if (!file_.fill(size)) return fail(tooShort("the file ends inside point " + std::to_string(done)));
        return fail(sink_.refusal(p, "byte " + std::to_string(start + done * size)));
    }

    // Two uint32 sizes, then LZF data: all values of the first field, all of the second, ...
    Result<void> readCompressed() {
        if (!file_.fill(8)) return fail(tooShort("expected the compressed and the uncompressed size"));
        const std::uint64_t packed = loadAs<std::uint32_t>(file_.data(), !machineIsLittleEndian());
        const std::uint64_t unpacked = loadAs<std::uint32_t>(file_.data() + 4, !machineIsLittleEndian());
        file_.consume(8);
        // PCL omits padding fields in compressed data; others write them.
        const auto fits = [&](bool withPadding) {
            const std::uint64_t size = header_.bytesPerPoint(withPadding);
            return unpacked / size == count() && unpacked % size == 0;
        };
        if (!fits(false) && !fits(true)) {
            return fail(tooShort("the compressed data unpacks to " + std::to_string(unpacked) +
                                 " bytes, which are not the announced " + std::to_string(count()) +
                                 " points of " + std::to_string(header_.bytesPerPoint(false)) + " bytes"));
        }
        if (count() == 0) return {};
        if (unpacked > packed * kLzfGreatestRatio || !file_.fill(packed)) {
            return fail(tooShort("the compressed data is cut short: announced " + std::to_string(packed) +
                                 " bytes for " + std::to_string(unpacked) + ", found " +
                                 std::to_string(file_.remaining().value_or(file_.available()))));
        }
        std::vector<char> bytes(unpacked);
        const unsigned written = lzf_decompress(file_.data(), static_cast<unsigned>(packed), bytes.data(),
                                                static_cast<unsigned>(unpacked));
        if (written != unpacked) return fail(tooShort("the compressed data is damaged"));
        return readFieldByField(bytes, !fits(false));
    }

    Result<void> readFieldByField(const std::vector<char>& bytes, bool withPadding) {
        std::array<const char*, 3> column = {};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            column[axis] = bytes.data() + bytesBefore(header_.coordinates[axis], withPadding) * count();
        }
        sink_.reserve(count());
        for (std::uint64_t i = 0; i < count(); ++i) {
            const Point3 p = load(column[0] + i * scalarSize(type_[0]), column[1] + i * scalarSize(type_[1]),
                                  column[2] + i * scalarSize(type_[2]));
            if (!add(p)) return fail(sink_.refusal(p, "point " + std::to_string(i)));
        }
        return {};
    }

    std::uint64_t bytesBefore(std::size_t field, bool withPadding) const {
        std::uint64_t sum = 0;
        for (std::size_t f = 0; f < field; ++f) {
            if (withPadding || !header_.fields[f].isPadding()) sum += header_.fields[f].bytes();
        }
        return sum;
    }

    // PCD files have the byte order of the machine that wrote them: little-endian in practice.
    Point3 load(const char* x, const char* y, const char* z) const {
        const bool swapped = !machineIsLittleEndian();
        return {loadScalar(x, type_[0], swapped), loadScalar(y, type_[1], swapped),
                loadScalar(z, type_[2], swapped)};
    }

    Error tooShort(const std::string& what) const { return file_.malformedByte(file_.offset(), what); }

    InputFile& file_;
    const PcdHeader& header_;
    ScanContent& content_;
    VertexSink sink_;
    std::array<ScalarType, 3> type_ = {};
};

}  // namespace

Result<ScanContent> readPcd(InputFile& file, std::size_t maxPoints) {
    const auto header = HeaderParser(file).parse();
    RETURN_IF_ERROR(header);
    ScanContent content;
    switch (header->encoding) {
        case PcdEncoding::kAscii: content.format = "PCD ASCII"; break;
        case PcdEncoding::kBinary: content.format = "PCD binary"; break;
        case PcdEncoding::kCompressed: content.format = "PCD binary_compressed"; break;
    }
    PcdBody body(file, *header, content, maxPoints);
    RETURN_IF_ERROR(body.read());
    return content;
}

}  // namespace shapedb::io
