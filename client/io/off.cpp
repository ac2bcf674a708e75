// SPDX-License-Identifier: Apache-2.0
// OFF (Geomview object file format) as text, with the prefixes that only add data to vertices.
//
// Not CGAL's reader, which does not notice what follows the last announced face.
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "client/io/formats.h"
#include "client/io/text.h"
#include "client/io/word_reader.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

struct OffCounts {
    std::uint64_t vertices = 0;
    std::uint64_t faces = 0;
};

// The prefix of OFF in the first word, which may go on with the first count ("OFF8"): ST, C and N.
struct OffPrefix {
    bool known = false;
    std::size_t length = 0;        ///< of the prefix
    std::size_t extraNumbers = 0;  ///< of a vertex, after its coordinates
};

OffPrefix parsePrefix(std::string_view word) {
    OffPrefix prefix;
    const auto take = [&](std::string_view letters, std::size_t numbers) {
        if (!equalsIgnoringCase(word.substr(prefix.length, letters.size()), letters)) return;
        // "nOFF" has vertices of another dimension.
        if (letters == "n" && word.size() > 1 && word.substr(prefix.length, 2) == "nO") return;
        prefix.length += letters.size();
        prefix.extraNumbers += numbers;
    };
    take("st", 2);
    take("c", 4);
    take("n", 3);
    prefix.known = equalsIgnoringCase(word.substr(prefix.length, 3), "off");
    return prefix;
}

class OffReader {
  public:
    OffReader(InputFile& file, std::size_t maxPoints)
        : file_(file), words_(file), sink_(file, content_.vertices, maxPoints), fan_(content_.triangles) {}

    Result<ScanContent> read() {
        file_.decodeText();
        RETURN_IF_ERROR(readHeader());
        if (counts_.faces <= std::numeric_limits<std::uint64_t>::max() - counts_.vertices) {
            wordByWord_ = words_.hasFewerLinesThan(counts_.vertices + counts_.faces);
        }
        if (onCountsLine_) endRecord();
        for (std::uint64_t i = 0; i < counts_.vertices; ++i) {
            RETURN_IF_ERROR(readVertex(i));
        }
        for (std::uint64_t i = 0; i < counts_.faces; ++i) {
            RETURN_IF_ERROR(readFace(i));
        }
        if (!words_.next().empty()) {
            return fail(file_.malformedLine("data after the last of the announced " +
                                            countText(counts_.vertices, "vertex", "vertices") + " and " +
                                            countText(counts_.faces, "face")));
        }
        content_.format = "OFF";
        return std::move(content_);
    }

  private:
    Result<void> readHeader() {
        std::string_view word = words_.next();
        if (word.empty()) return fail(file_.malformedLine("expected OFF; the file has no content"));
        // "OFF 8 6 12", "OFF8 6 12" (in well-known collections), or without the word.
        const std::string lower = lowerCase(word);
        const std::size_t name = lower.find("off");
        if (name != std::string::npos) {
            const OffPrefix prefix = parsePrefix(word);
            if (!prefix.known) {
                return fail(
                    file_.malformedLine("expected OFF, COFF, NOFF, STOFF or a mix of these prefixes, found " +
                                        inQuotes(word.substr(0, name + 3))));
            }
            extraNumbers_ = prefix.extraNumbers;
            word.remove_prefix(prefix.length + 3);
            if (word.empty()) word = words_.next();
            if (equalsIgnoringCase(word, "binary")) {
                return fail(
                    file_.malformedLine("binary OFF is not read; convert the file to text OFF or PLY"));
            }
            if (word.empty()) return fail(cutShort("the numbers of vertices and faces"));
        }
        return readCounts(word);
    }

    Result<void> readCounts(std::string_view vertices) {
        if (!parseCount(vertices, counts_.vertices)) return fail(notCounts(vertices));
        const std::string_view faces = words_.next();
        if (!parseCount(faces, counts_.faces)) return fail(notCounts(faces));
        // The number of edges may be missing. It is there if it is on the line, or on one of its own.
        onCountsLine_ = !words_.atLineEnd();
        if (onCountsLine_ || (words_.nextLine() && words_.wordsOnLine() == 1)) words_.next();
        return {};
    }

    Error notCounts(std::string_view found) const {
        return file_.malformedLine("expected the numbers of vertices and faces, found " +
                                   inQuotesNotANumber(found));
    }

    // What follows what is needed on the line is ignored: normal, colour, texture position.
    void endRecord() {
        if (!wordByWord_) words_.endLine();
    }

    Result<void> readVertex(std::uint64_t index) {
        const auto name = [&] {
            return "vertex " + std::to_string(index) + " of " + std::to_string(counts_.vertices);
        };
        Point3 p;
        for (double* coordinate : {&p.x, &p.y, &p.z}) {
            const std::string_view word = words_.next();
            if (word.empty()) return fail(cutShort(name()));
            if (!parseReal(word, *coordinate)) {
                return fail(file_.malformedLine("expected three numbers for " + name() + ", found " +
                                                inQuotesNotANumber(word)));
            }
        }
        if (!sink_.add(p)) return fail(sink_.refusal(p, "line " + std::to_string(file_.lineNumber())));
        if (wordByWord_) {
            for (std::size_t i = 0; i < extraNumbers_; ++i) words_.next();
        }
        endRecord();
        return {};
    }

    Result<void> readFace(std::uint64_t index) {
        const auto name = [&] {
            return "face " + std::to_string(index) + " of " + std::to_string(counts_.faces);
        };
        std::string_view word = words_.next();
        if (word.empty()) return fail(cutShort(name()));
        std::uint64_t corners = 0;
        if (!parseCount(word, corners)) {
            return fail(file_.malformedLine("expected the number of corners of " + name() + ", found " +
                                            inQuotesNotANumber(word)));
        }
        fan_.begin();
        for (std::uint64_t i = 0; i < corners; ++i) {
            word = words_.next();
            const auto corner = [&] { return "corner " + std::to_string(i) + " of " + name(); };
            if (word.empty()) return fail(cutShort(corner()));
            std::uint64_t vertex = 0;
            if (!parseCount(word, vertex)) {
                return fail(
                    file_.malformedLine("expected " + corner() + ", found " + inQuotesNotANumber(word)));
            }
            if (vertex >= counts_.vertices || vertex > std::numeric_limits<std::uint32_t>::max()) {
                return fail(file_.malformedLine(
                    name() + " names vertex " + std::to_string(vertex) + ", but the file has " +
                    countText(counts_.vertices, "vertex", "vertices") + ", counted from 0"));
            }
            fan_.add(static_cast<std::uint32_t>(vertex));
        }
        endRecord();
        return {};
    }

    Error cutShort(const std::string& expected) const {
        return file_.malformed("the file ends after line " + std::to_string(file_.lineNumber()) +
                               ": expected " + expected);
    }

    InputFile& file_;
    WordReader words_;
    ScanContent content_;
    VertexSink sink_;
    PolygonFan fan_;
    OffCounts counts_;
    std::size_t extraNumbers_ = 0;
    bool onCountsLine_ = false;
    bool wordByWord_ = false;
};

}  // namespace

Result<ScanContent> readOff(InputFile& file, std::size_t maxPoints) {
    return OffReader(file, maxPoints).read();
}

}  // namespace shapedb::io
