// SPDX-License-Identifier: Apache-2.0
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
#include "client/io/pcd_header.h"
#include "client/io/scalar.h"
#include "client/io/text.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

// LZF writes at most 264 bytes (its longest back reference) for 3 bytes read.
constexpr std::uint64_t kLzfGreatestRatio = 88;

class PcdBody {
  public:
    PcdBody(InputFile& file, const PcdHeader& header, ScanContent& content, std::size_t maxPoints)
        : file_(file), header_(header), content_(content), sink_(file, content.vertices, maxPoints) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            type_[axis] = *scalarType(header.fields[header.coordinates[axis]]);
        }
    }

    Result<void> read() {
        if (header_.encoding == PcdEncoding::kAscii) return readAscii();
        if (file_.isRecoded()) return fail(file_.malformed("binary data cannot follow a header in UTF-16"));
        file_.beginBinary();
        RETURN_IF_ERROR(header_.encoding == PcdEncoding::kBinary ? readBinary() : readCompressed());
        // PCL writes zero bytes after the points.
        if (file_.onlyPaddingLeft()) return {};
        return fail(file_.malformedByte(file_.offset(), afterTheLast()));
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
            if (!nextContentLine(line)) {
                return fail(file_.malformed("the file ends after line " + std::to_string(file_.lineNumber()) +
                                            ": the header announces " + countText(count(), "point") +
                                            ", found " + std::to_string(i)));
            }
            RETURN_IF_ERROR(readAsciiPoint(line));
            ++i;
        }
        if (!nextContentLine(line)) return {};
        return fail(file_.malformedLine(afterTheLast()));
    }

    bool nextContentLine(std::string_view& line) {
        while (file_.readLine(line)) {
            line = withoutComment(line);
            if (!isBlankLine(line)) return true;
        }
        return false;
    }

    std::string afterTheLast() const {
        return "data after the last of the announced " + countText(count(), "point");
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
                                                    inQuotesNotANumber(word)));
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
                return fail(tooShort("the header announces " + countText(count(), "point") + " of " +
                                     countText(size, "byte") + ", but the file has room for " +
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
            return fail(tooShort("the compressed data does not unpack to the announced " +
                                 countText(count(), "point") + " of " +
                                 countText(header_.bytesPerPoint(false), "byte")));
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
        if (written != unpacked) {
            // Some programs write data that does not get smaller as it is.
            if (packed != unpacked) return fail(tooShort("the compressed data is damaged"));
            std::copy_n(file_.data(), bytes.size(), bytes.begin());
        }
        file_.consume(static_cast<std::size_t>(packed));
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
    file.decodeText();
    const auto header = readPcdHeader(file);
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
