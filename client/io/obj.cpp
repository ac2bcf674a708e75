// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: v and f lines; nothing else changes the surface.
//
// Not tinyobjloader, which reads "v 1 abc nan" as (1, 0, 0) without an error, overflows on long indices
// (atoi), loses the last digits of coordinates, and gives no line for a face with a missing vertex.
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "client/io/formats.h"
#include "client/io/text.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

class ObjReader {
  public:
    ObjReader(InputFile& file, std::size_t maxPoints)
        : file_(file), sink_(file, content_.vertices, maxPoints), fan_(content_.triangles) {}

    Result<ScanContent> read() {
        file_.decodeText();
        std::string_view rest;
        while (file_.readLine(rest)) {
            rest = withoutComment(rest);
            const std::string_view keyword = nextWord(rest);
            // In lower case, but nobody means anything else by these letters.
            if (equalsIgnoringCase(keyword, "v")) {
                RETURN_IF_ERROR(readVertex(continued(rest)));
            } else if (equalsIgnoringCase(keyword, "f") || equalsIgnoringCase(keyword, "fo")) {
                RETURN_IF_ERROR(readFace(continued(rest)));
            }
        }
        if (static_cast<std::uint64_t>(greatestIndex_) > content_.vertices.size()) {
            return fail(missingVertex(greatestIndexLine_, std::to_string(greatestIndex_)));
        }
        if (content_.vertices.empty()) {
            return fail(
                file_.malformed("no vertex (a line 'v x y z') found; this is not a Wavefront OBJ file"));
        }
        content_.format = "OBJ";
        return std::move(content_);
    }

  private:
    // A backslash at the end of a line continues it. Only of vertices and faces: in comments and in the names
    // of files ("mtllib C:\textures\") it is a letter like any other, and the next line may be a vertex.
    std::string_view continued(std::string_view rest) {
        const auto withoutEnd = [](std::string_view line) {
            while (!line.empty() && isBlank(line.back())) line.remove_suffix(1);
            return line;
        };
        rest = withoutEnd(rest);
        if (rest.empty() || rest.back() != '\\') return rest;
        joined_.clear();
        do {
            joined_.append(rest.substr(0, rest.size() - 1)).push_back(' ');
            if (!file_.readLine(rest)) rest = {};
            rest = withoutEnd(withoutComment(rest));
        } while (!rest.empty() && rest.back() == '\\');
        return joined_.append(rest);
    }

    Result<void> readVertex(std::string_view rest) {
        Point3 p;
        // A weight or a colour may follow.
        for (double* coordinate : {&p.x, &p.y, &p.z}) {
            const std::string_view word = nextWord(rest);
            if (!parseReal(word, *coordinate)) {
                return fail(file_.malformedLine("expected three numbers after 'v' for vertex " +
                                                std::to_string(content_.vertices.size()) + ", found " +
                                                inQuotesNotANumber(word)));
            }
        }
        if (!sink_.add(p)) return fail(sink_.refusal(p, "line " + std::to_string(file_.lineNumber())));
        return {};
    }

    // Corners are "7", "7/1", "7//3" or "7/1/3"; negative ones count back from the last vertex.
    Result<void> readFace(std::string_view rest) {
        fan_.begin();
        for (std::string_view corner = nextWord(rest); !corner.empty(); corner = nextWord(rest)) {
            std::int64_t index = 0;
            if (!parseInteger(corner.substr(0, corner.find('/')), index) || index == 0) {
                return fail(file_.malformedLine("expected vertex numbers from 1 after 'f', found " +
                                                inQuotes(corner)));
            }
            const auto known = static_cast<std::int64_t>(content_.vertices.size());
            if (index < -known || index > std::numeric_limits<std::uint32_t>::max()) {
                return fail(missingVertex(file_.lineNumber(), std::to_string(index)));
            }
            if (index < 0) index += known + 1;
            // Checked at the end: the vertex may come later in the file.
            if (index > greatestIndex_) {
                greatestIndex_ = index;
                greatestIndexLine_ = file_.lineNumber();
            }
            fan_.add(static_cast<std::uint32_t>(index - 1));
        }
        return {};
    }

    Error missingVertex(std::uint64_t line, const std::string& index) const {
        return file_.malformed(
            "line " + std::to_string(line) + ": a face names vertex " + index + ", but the file has " +
            countText(content_.vertices.size(), "vertex", "vertices") + ", counted from 1");
    }

    InputFile& file_;
    ScanContent content_;
    VertexSink sink_;
    PolygonFan fan_;
    std::string joined_;
    std::int64_t greatestIndex_ = 0;
    std::uint64_t greatestIndexLine_ = 0;
};

}  // namespace

Result<ScanContent> readObj(InputFile& file, std::size_t maxPoints) {
    return ObjReader(file, maxPoints).read();
}

}  // namespace shapedb::io
