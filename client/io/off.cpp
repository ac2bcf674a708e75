// OFF (Geomview object file format) as text, with the prefixes that only add data to vertices.
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "client/io/formats.h"
#include "client/io/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

struct OffCounts {
    std::uint64_t vertices = 0;
    std::uint64_t faces = 0;
};

class OffReader {
  public:
    OffReader(InputFile& file, std::size_t maxPoints)
        : file_(file), sink_(file, content_.vertices, maxPoints), fan_(content_.triangles) {}

    Result<ScanContent> read() {
        file_.skipByteOrderMark();
        RETURN_IF_ERROR(readHeader());
        for (std::uint64_t i = 0; i < counts_.vertices; ++i) {
            RETURN_IF_ERROR(readVertex(i));
        }
        for (std::uint64_t i = 0; i < counts_.faces; ++i) {
            RETURN_IF_ERROR(readFace(i));
        }
        if (nextContentLine()) {
            return fail(file_.malformedLine("data after the last of the announced " +
                                            std::to_string(counts_.vertices) + " vertices and " +
                                            std::to_string(counts_.faces) + " faces"));
        }
        content_.format = "OFF";
        return std::move(content_);
    }

  private:
    // Reads the next line with content into line_.
    bool nextContentLine() {
        while (file_.readLine(line_)) {
            line_ = withoutComment(line_);
            if (line_.find_first_not_of(" \t\v\f") != std::string_view::npos) return true;
        }
        return false;
    }

    Result<void> readHeader() {
        if (!nextContentLine()) return fail(file_.malformedLine("expected OFF; the file is empty"));
        // "OFF 8 6 12", "OFF8 6 12" (in well-known collections), or without the word.
        std::string_view rest = line_;
        while (!rest.empty() && isBlank(rest.front())) rest.remove_prefix(1);
        const std::string_view magic = rest.substr(0, rest.find("OFF") + 3);
        if (rest.find("OFF") != std::string_view::npos) {
            if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF" &&
                magic != "STOFF" && magic != "STCOFF" && magic != "STNOFF" && magic != "STCNOFF") {
                return fail(file_.malformedLine(
                    "expected OFF, COFF, NOFF, STOFF or a mix of these prefixes, found " + inQuotes(magic)));
            }
            rest.remove_prefix(magic.size());
            if (rest.find("BINARY") != std::string_view::npos) {
                return fail(
                    file_.malformedLine("binary OFF is not read; convert the file to text OFF or PLY"));
            }
            if (rest.find_first_not_of(" \t\v\f") == std::string_view::npos) {
                if (!nextContentLine()) return fail(cutShort("the numbers of vertices and faces"));
                rest = line_;
            }
        }
        return readCounts(rest);
    }

    Result<void> readCounts(std::string_view rest) {
        const std::string_view vertices = nextWord(rest);
        const std::string_view faces = nextWord(rest);
        if (!parseCount(vertices, counts_.vertices) || !parseCount(faces, counts_.faces)) {
            return fail(file_.malformedLine("expected the numbers of vertices and faces, found " +
                                            inQuotes(vertices) + " and " + inQuotes(faces)));
        }
        return {};
    }

    Result<void> readVertex(std::uint64_t index) {
        const std::string name =
            "vertex " + std::to_string(index) + " of " + std::to_string(counts_.vertices);
        if (!nextContentLine()) return fail(cutShort(name));
        Point3 p;
        // Ignore what follows: normal, colour, texture position.
        for (double* coordinate : {&p.x, &p.y, &p.z}) {
            const std::string_view word = nextWord(line_);
            if (!parseReal(word, *coordinate)) {
                return fail(
                    file_.malformedLine("expected three numbers for " + name + ", found " + inQuotes(word)));
            }
        }
        if (!sink_.add(p)) return fail(sink_.refusal(p, "line " + std::to_string(file_.lineNumber())));
        return {};
    }

    Result<void> readFace(std::uint64_t index) {
        const std::string name = "face " + std::to_string(index) + " of " + std::to_string(counts_.faces);
        if (!nextContentLine()) return fail(cutShort(name));
        std::string_view word = nextWord(line_);
        std::uint64_t corners = 0;
        if (!parseCount(word, corners)) {
            return fail(file_.malformedLine("expected the number of corners of " + name + ", found " +
                                            inQuotes(word)));
        }
        fan_.begin();
        for (std::uint64_t i = 0; i < corners; ++i) {
            word = nextWord(line_);
            std::uint64_t vertex = 0;
            if (!parseCount(word, vertex)) {
                return fail(file_.malformedLine("expected corner " + std::to_string(i) + " of " + name +
                                                ", found " + inQuotes(word)));
            }
            if (vertex >= counts_.vertices || vertex > std::numeric_limits<std::uint32_t>::max()) {
                return fail(file_.malformedLine(name + " names vertex " + std::to_string(vertex) +
                                                ", but the file has " + std::to_string(counts_.vertices) +
                                                " vertices, counted from 0"));
            }
            fan_.add(static_cast<std::uint32_t>(vertex));
        }
        return {};
    }

    Error cutShort(const std::string& expected) const {
        return file_.malformed("the file ends after line " + std::to_string(file_.lineNumber()) +
                               ": expected " + expected);
    }

    InputFile& file_;
    ScanContent content_;
    VertexSink sink_;
    PolygonFan fan_;
    OffCounts counts_;
    std::string_view line_;
};

}  // namespace

Result<ScanContent> readOff(InputFile& file, std::size_t maxPoints) {
    return OffReader(file, maxPoints).read();
}

}  // namespace shapedb::io
