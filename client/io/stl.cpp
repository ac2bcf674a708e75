// SPDX-License-Identifier: Apache-2.0
// STL, binary and ASCII. Corners at the same position become one vertex.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/io/formats.h"
#include "client/io/scalar.h"
#include "client/io/text.h"
#include "client/io/word_reader.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

constexpr std::uint64_t kHeaderBytes = 80;
constexpr std::uint64_t kTriangleBytes = 50;  // normal, three corners, two attribute bytes
constexpr std::uint64_t kNormalBytes = 12;
constexpr std::size_t kSniffedBytes = 1024;  // a text file this long without a zero byte is text

// Finds the vertex at a position, by open addressing: a map of positions would take most of the reading time
// of a large file.
class VertexTable {
  public:
    explicit VertexTable(const PointCloud& vertices) : vertices_(&vertices) {}

    /// The slot of `p`: the number of the vertex there, or kFree, which the caller replaces after appending
    /// one.
    std::uint32_t& place(const Point3& p) {
        if (2 * vertices_->size() >= places_.size()) grow();
        return find(p);
    }

    static constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

  private:
    static std::uint64_t hash(const Point3& p) {
        std::uint64_t hash = 0;
        // Adding zero turns -0 into 0: they are equal and must hash alike.
        for (const double coordinate : {p.x + 0.0, p.y + 0.0, p.z + 0.0}) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &coordinate, sizeof bits);
            hash = (hash ^ bits) * 0x9e3779b97f4a7c15ULL;
            hash ^= hash >> 32;
        }
        return hash;
    }

    std::uint32_t& find(const Point3& p) {
        std::size_t at = hash(p) & (places_.size() - 1);
        while (places_[at] != kFree && (*vertices_)[places_[at]] != p) at = (at + 1) & (places_.size() - 1);
        return places_[at];
    }

    void grow() {
        places_.assign(std::max<std::size_t>(1024, 2 * places_.size()), kFree);
        for (std::size_t v = 0; v < vertices_->size(); ++v)
            find((*vertices_)[v]) = static_cast<std::uint32_t>(v);
    }

    const PointCloud* vertices_;
    std::vector<std::uint32_t> places_;  // a power of two, at most half used
};

class StlReader {
  public:
    StlReader(InputFile& file, std::size_t maxPoints)
        : file_(file),
          words_(file),
          sink_(file, content_.vertices, maxPoints),
          fan_(content_.triangles),
          vertexAt_(content_.vertices) {}

    Result<ScanContent> read() {
        const bool ascii = looksAscii();
        const auto done = ascii ? readAscii() : readBinary();
        RETURN_IF_ERROR(done);
        content_.format = ascii ? "STL ASCII" : "STL binary";
        return std::move(content_);
    }

  private:
    // Binary files may start with "solid" too, so the exact size of a binary file, or a zero byte, decides.
    bool looksAscii() {
        file_.peek(kSniffedBytes);
        const auto size = file_.remaining();
        if (size && file_.available() >= kHeaderBytes + 4 &&
            (*size - kHeaderBytes - 4) == kTriangleBytes * announcedTriangles()) {
            return false;
        }
        file_.decodeText();
        std::string_view head = file_.peek(kSniffedBytes);
        // Zero bytes may fill up the end of a text file.
        head = head.substr(0, head.find_last_not_of('\0') + 1);
        return equalsIgnoringCase(firstWord(head).substr(0, 5), "solid") &&
               head.find('\0') == std::string_view::npos;
    }

    // Of text, after blank lines and comments.
    static std::string_view firstWord(std::string_view text) {
        while (!text.empty()) {
            const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
            std::string_view line = withoutComment(text.substr(0, end));
            const std::string_view word = nextWord(line);
            if (!word.empty()) return word;
            text.remove_prefix(std::min(end + 1, text.size()));
        }
        return {};
    }

    // Text of another kind: what would be the number of triangles means nothing.
    bool looksLikeText() {
        const std::string_view head = file_.peek(kSniffedBytes);
        return std::none_of(head.begin(), head.end(), [](char c) {
            return (c >= 0 && c < ' ' && !isBlank(c) && c != '\n') || c == '\x7f';
        });
    }

    // Four letters where the number of triangles stands are no number: millions, which the file does not
    // have.
    static bool isOfLetters(std::uint64_t count) {
        for (int i = 0; i < 4; ++i, count >>= 8) {
            if (const std::uint64_t letter = count & 0xff; letter < '\t' || letter > '~') return false;
        }
        return true;
    }

    Error notStl() {
        return file_.malformed(
            "this is not an STL file: it does not begin with 'solid' and does not have the size of a binary "
            "one");
    }

    // The header must be in the buffer.
    std::uint64_t announcedTriangles() const {
        return loadAs<std::uint32_t>(file_.data() + kHeaderBytes, !machineIsLittleEndian());
    }

    Result<void> readBinary() {
        if (!file_.fill(kHeaderBytes + 4)) {
            return fail(file_.malformed(
                "expected 'solid' (ASCII STL) or the 84 bytes a binary STL starts with, found " +
                std::to_string(file_.available()) + " bytes"));
        }
        if (looksLikeText()) {
            return fail(
                file_.malformed("expected 'solid', found " + inQuotes(firstWord(file_.peek(kSniffedBytes))) +
                                "; this is not an ASCII STL file, and its size is not that of a binary one"));
        }
        const std::uint64_t count = announcedTriangles();
        file_.consume(static_cast<std::size_t>(kHeaderBytes + 4));
        const auto left = file_.remaining();
        if (left && count > *left / kTriangleBytes) {
            if (isOfLetters(count)) return fail(notStl());
            return fail(file_.malformedByte(
                kHeaderBytes, "the header announces " + countText(count, "triangle") +
                                  ", but the file has room for " + std::to_string(*left / kTriangleBytes)));
        }
        const std::uint64_t start = file_.offset();
        Point3 p;
        const std::uint64_t done = visitRecords(file_, count, kTriangleBytes, [&](const char* record, auto) {
            fan_.begin();
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const char* at = record + kNormalBytes + 12 * corner;
                const bool swapped = !machineIsLittleEndian();
                p = {loadAs<float>(at, swapped), loadAs<float>(at + 4, swapped),
                     loadAs<float>(at + 8, swapped)};
                if (!addCorner(p)) return false;
            }
            return true;
        });
        if (done < count) {
            const std::uint64_t place = start + done * kTriangleBytes;
            if (!file_.fill(kTriangleBytes)) {
                if (isOfLetters(count)) return fail(notStl());
                return fail(file_.malformedByte(place, "the file ends inside triangle " +
                                                           std::to_string(done) + " of " +
                                                           std::to_string(count)));
            }
            return fail(
                sink_.refusal(p, "byte " + std::to_string(place) + ", triangle " + std::to_string(done)));
        }
        if (!file_.onlyPaddingLeft()) {
            return fail(file_.malformedByte(
                file_.offset(), "data after the last of the announced " + countText(count, "triangle")));
        }
        return {};
    }

    // solid (facet, outer loop, vertex x 3, endloop, endfacet)* endsolid, one or more times. Line ends are no
    // more than blanks, but for the names of solids, which may have several words.
    Result<void> readAscii() {
        for (std::string_view word = nextKeyword(); !word.empty(); word = nextKeyword()) {
            if (!equalsIgnoringCase(word, "solid")) return fail(unexpected("solid", word));
            skipName();
            // Some programs write the name after "endsolid" without a blank.
            for (word = nextKeyword(); !equalsIgnoringCase(word.substr(0, 8), "endsolid");
                 word = nextKeyword()) {
                if (words_.ended()) return fail(unexpected("endsolid", word));
                if (!equalsIgnoringCase(word, "facet")) return fail(unexpected("facet", word));
                RETURN_IF_ERROR(readFacet());
            }
            words_.endLine();
        }
        return {};
    }

    // Some programs write "end loop", "end facet" and "end solid".
    std::string_view nextKeyword() {
        const std::string_view word = words_.next();
        if (!equalsIgnoringCase(word, "end")) return word;
        keyword_ = "end";
        return keyword_.append(words_.nextOnLine());
    }

    // A solid may also stand on one line with its facets.
    void skipName() {
        while (!words_.atLineEnd() && !words_.lineGoesOnWith("facet", "normal")) words_.nextOnLine();
    }

    Result<void> readFacet() {
        std::string_view word = words_.next();
        if (equalsIgnoringCase(word, "normal")) {
            word = words_.next();
            for (int i = 0; i < 3 && !equalsIgnoringCase(word, "outer"); ++i) word = words_.next();
        }
        if (!equalsIgnoringCase(word, "outer")) return fail(unexpected("outer", word));
        RETURN_IF_ERROR(expect("loop"));
        fan_.begin();
        for (int corner = 0; corner < 3; ++corner) {
            RETURN_IF_ERROR(expect("vertex"));
            RETURN_IF_ERROR(readCorner());
        }
        RETURN_IF_ERROR(expect("endloop"));
        return expect("endfacet");
    }

    Result<void> expect(const char* keyword) {
        const std::string_view word = nextKeyword();
        if (equalsIgnoringCase(word, keyword)) return {};
        return fail(unexpected(keyword, word));
    }

    Error unexpected(const std::string& keyword, std::string_view word) const {
        if (words_.ended()) {
            return file_.malformed("the file ends after line " + std::to_string(file_.lineNumber()) +
                                   ": expected '" + keyword + "'");
        }
        return file_.malformedLine("expected '" + keyword + "', found " + inQuotes(word));
    }

    Result<void> readCorner() {
        Point3 p;
        const std::uint64_t begun = file_.lineNumber();
        for (double* coordinate : {&p.x, &p.y, &p.z}) {
            const std::string_view word = words_.next();
            if (!parseReal(word, *coordinate)) {
                const bool sameLine = begun == file_.lineNumber() && !words_.ended();
                return fail(file_.malformed("line " + std::to_string(begun) +
                                            ": expected three numbers after 'vertex', found " +
                                            (sameLine ? inQuotesNotANumber(word) : "nothing")));
            }
        }
        if (!addCorner(p)) return fail(sink_.refusal(p, "line " + std::to_string(file_.lineNumber())));
        return {};
    }

    bool addCorner(const Point3& p) {
        if (!isFinite(p)) return false;
        std::uint32_t& vertex = vertexAt_.place(p);
        if (vertex == VertexTable::kFree) {
            if (content_.vertices.size() >= VertexTable::kFree || !sink_.add(p)) return false;
            vertex = static_cast<std::uint32_t>(content_.vertices.size() - 1);
        }
        fan_.add(vertex);
        return true;
    }

    InputFile& file_;
    WordReader words_;
    std::string keyword_;  // what nextKeyword has joined
    ScanContent content_;
    VertexSink sink_;
    PolygonFan fan_;
    VertexTable vertexAt_;
};

}  // namespace

Result<ScanContent> readStl(InputFile& file, std::size_t maxPoints) {
    return StlReader(file, maxPoints).read();
}

}  // namespace shapedb::io
