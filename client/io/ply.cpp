// SPDX-License-Identifier: Apache-2.0
// PLY: ASCII and both binary byte orders, any elements and properties in any order. Written here because
// Debian 12 packages no PLY library.
//
// Elements are read in the order of the header. A binary element without lists has records of one size and is
// read (vertices) or skipped in one go; everything else goes through a record reader (ply_record.h).
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "client/io/face_guess.h"
#include "client/io/formats.h"
#include "client/io/ply_header.h"
#include "client/io/ply_record.h"
#include "client/io/scalar.h"
#include "client/io/text.h"
#include "client/io/word_reader.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

constexpr std::size_t kNoProperty = std::numeric_limits<std::size_t>::max();

Error negativeLength(const InputFile& file, const std::string& where, const PlyElement& element,
                     std::uint64_t index) {
    return file.malformed(where + ": " + recordName(element, index) + " has a list of negative length");
}

// Of a list of the current record; 1 of a single number.
template <typename Record>
Result<std::int64_t> readLength(const InputFile& file, Record& record, const PlyElement& element,
                                std::uint64_t index, const PlyProperty& property) {
    std::int64_t length = 1;
    if (property.isList && !record.integer(property.countType, length)) {
        return fail(record.error(element, index, "the length of list " + property.name));
    }
    if (length < 0) return fail(negativeLength(file, record.where(), element, index));
    return length;
}

// Skips one property of the current record.
template <typename Record>
Result<void> skipProperty(const InputFile& file, Record& record, const PlyElement& element,
                          std::uint64_t index, const PlyProperty& property) {
    const auto length = readLength(file, record, element, index, property);
    RETURN_IF_ERROR(length);
    if (!record.skip(property.type, static_cast<std::uint64_t>(*length))) {
        return fail(record.error(element, index, property.name));
    }
    return {};
}

template <typename Record>
Result<void> endRecord(Record& record, const PlyElement& element, std::uint64_t index) {
    if (!record.end()) return fail(record.error(element, index, "the line end after the last value"));
    return {};
}

// Finds the properties x, y and z. A name in capitals counts if there is none in lower case.
Result<std::array<std::size_t, 3>> findCoordinates(const InputFile& file, const PlyElement& vertex) {
    std::array<std::size_t, 3> at = {kNoProperty, kNoProperty, kNoProperty};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const char letter : {"xyz"[axis], "XYZ"[axis]}) {
            if (at[axis] != kNoProperty) break;
            for (std::size_t i = 0; i < vertex.properties.size(); ++i) {
                const PlyProperty& property = vertex.properties[i];
                if (property.name != std::string(1, letter)) continue;
                if (at[axis] != kNoProperty || property.isList) {
                    return fail(file.malformed("header: element vertex needs one number '" + property.name +
                                               "', not a list or two of them"));
                }
                at[axis] = i;
            }
        }
        if (at[axis] == kNoProperty) {
            return fail(
                file.malformed(std::string("header: element vertex has no property '") + "xyz"[axis] + "'"));
        }
    }
    return at;
}

bool isFaceName(const std::string& name) {
    return name == "face" || name == "faces" || name == "polygon" || name == "polygons" ||
           name == "triangle" || name == "triangles";
}

struct Indices {
    std::size_t at = kNoProperty;  ///< the list that names the corners of faces or strips
    bool guessed = false;          ///< it does if every entry could
};

// Passing over faces in silence would take a mesh for a few points, so the only list of integers of a face
// counts under any name, and a face without any list of integers is an error.
Result<Indices> findIndices(const InputFile& file, const PlyElement& element) {
    // A grid names the vertex at each place, of which there is one or none.
    if (element.name == "vertex" || element.name == "range_grid") return Indices{};
    const bool face = isFaceName(element.name) || element.name == "tristrips";
    std::size_t named = kNoProperty;
    std::size_t only = kNoProperty;
    std::size_t lists = 0;
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const PlyProperty& property = element.properties[i];
        if (!property.isList) continue;
        const std::string name = lowerCase(property.name);
        if (name == "vertex_indices" || name == "vertex_index") named = i;
        if (isFloating(property.type)) continue;
        only = i;
        ++lists;
    }
    if (named != kNoProperty) {
        if (!isFloating(element.properties[named].type)) return Indices{named, false};
        return fail(file.malformed("header: the indices of element " + element.name +
                                   " must be integers, not float or double"));
    }
    if (element.count == 0 || (!face && lists != 1)) return Indices{};
    if (lists == 1) return Indices{only, !face};
    return fail(file.malformed("header: element " + element.name +
                               " needs a list vertex_indices, which names " + "its corners" +
                               (lists > 1 ? "; it has several lists under other names" : "")));
}

// Reads the elements of one file in order.
class PlyBody {
  public:
    PlyBody(InputFile& file, const PlyHeader& header, ScanContent& content, std::size_t maxPoints)
        : file_(file),
          header_(header),
          content_(content),
          words_(file),
          sink_(file, content.vertices, maxPoints) {}

    Result<void> read() {
        RETURN_IF_ERROR(findVertexElement());
        if (isText()) {
            beginText();
        } else if (file_.isRecoded()) {
            return fail(file_.malformed("binary data cannot follow a header in UTF-16"));
        } else {
            file_.beginBinary();
        }
        for (const PlyElement& element : header_.elements) {
            // Such an element has no body, whatever its count says.
            if (element.properties.empty()) continue;
            const auto indices = findIndices(file_, element);
            RETURN_IF_ERROR(indices);
            RETURN_IF_ERROR(readElement(element, *indices));
        }
        settleGuesses();
        const std::string after = "data after the last element; the header announces too few";
        if (isText() && !words_.next().empty()) return fail(file_.malformedLine(after));
        if (!isText() && !file_.onlyPaddingLeft()) return fail(file_.malformedByte(file_.offset(), after));
        return {};
    }

  private:
    bool isText() const { return header_.encoding == PlyEncoding::kAscii; }

    void beginText() {
        words_.skipLinesOf("comment", "obj_info");
        std::uint64_t records = 0;
        for (const PlyElement& element : header_.elements) {
            if (element.properties.empty()) continue;
            if (element.count > std::numeric_limits<std::uint64_t>::max() - records) return;
            records += element.count;
        }
        wordByWord_ = words_.hasFewerLinesThan(records);
    }

    Result<void> findVertexElement() {
        const PlyElement* vertex = nullptr;
        for (const PlyElement& element : header_.elements) {
            if (element.name != "vertex") continue;
            if (vertex != nullptr) return fail(file_.malformed("header: element vertex appears twice"));
            vertex = &element;
        }
        if (vertex == nullptr) return fail(file_.malformed("header: there is no element vertex"));
        const auto coordinates = findCoordinates(file_, *vertex);
        RETURN_IF_ERROR(coordinates);
        coordinates_ = *coordinates;
        vertexCount_ = vertex->count;
        return {};
    }

    // Faces under unknown names, if there are no others.
    void settleGuesses() {
        const bool hasFaces = !content_.triangles.empty();
        for (FaceGuess& guess : guesses_) {
            if (hasFaces || !guess.good()) {
                content_.ignored.push_back(guess.name());
                continue;
            }
            const std::vector<Triangle> triangles = guess.takeTriangles();
            content_.triangles.insert(content_.triangles.end(), triangles.begin(), triangles.end());
        }
    }

    Result<void> readElement(const PlyElement& element, const Indices& indices) {
        if (indices.guessed) {
            guesses_.emplace_back(
                "list " + element.properties[indices.at].name + " of element " + element.name, vertexCount_);
        }
        if (isText()) return readElementWith(TextRecord(file_, words_, wordByWord_), element, indices);
        const bool swapped = (header_.encoding == PlyEncoding::kLittleEndian) != machineIsLittleEndian();
        const auto size = element.fixedSize();
        if (!size) return readElementWith(BinaryRecord(file_, swapped), element, indices);
        const auto left = file_.remaining();
        if (left && element.count > *left / *size) {
            return fail(file_.malformedByte(
                file_.offset(), "the header announces " + countText(element.count, element.name + " record") +
                                    " of " + countText(*size, "byte") + ", but the file has room for " +
                                    std::to_string(*left / *size)));
        }
        if (element.name == "vertex") return readFixedVertices(element, *size, swapped);
        const std::uint64_t start = file_.offset();
        if (element.count > std::numeric_limits<std::uint64_t>::max() / *size ||
            !file_.skip(element.count * *size)) {
            return fail(file_.malformedByte(start, "the file ends inside element " + element.name));
        }
        return {};
    }

    Result<void> readFixedVertices(const PlyElement& element, std::uint64_t size, bool swapped) {
        std::array<std::size_t, 3> offset = {};
        std::array<ScalarType, 3> type = {};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (std::size_t i = 0; i < coordinates_[axis]; ++i) {
                offset[axis] += scalarSize(element.properties[i].type);
            }
            type[axis] = element.properties[coordinates_[axis]].type;
        }
        const std::uint64_t start = file_.offset();
        if (file_.remaining()) sink_.reserve(element.count);
        Point3 p;
        const std::uint64_t done = visitRecords(file_, element.count, size, [&](const char* record, auto) {
            p = {loadScalar(record + offset[0], type[0], swapped),
                 loadScalar(record + offset[1], type[1], swapped),
                 loadScalar(record + offset[2], type[2], swapped)};
            return sink_.add(p);
        });
        if (done == element.count) return {};
        const std::uint64_t place = start + done * size;
        if (!file_.fill(size)) {
            return fail(file_.malformedByte(place, "the file ends inside " + recordName(element, done)));
        }
        return fail(sink_.refusal(p, "byte " + std::to_string(place)));
    }

    template <typename Record>
    Result<void> readElementWith(Record record, const PlyElement& element, const Indices& indices) {
        if (element.name == "vertex") return readVertices(record, element);
        const bool strips = element.name == "tristrips";
        for (std::uint64_t i = 0; i < element.count; ++i) {
            if (!record.begin()) return fail(record.error(element, i, ""));
            for (std::size_t j = 0; j < element.properties.size(); ++j) {
                const PlyProperty& property = element.properties[j];
                auto done = j != indices.at   ? skipProperty(file_, record, element, i, property)
                            : indices.guessed ? readGuess(record, element, i, property)
                            : strips          ? readIndices<TriangleStrip>(record, element, i, property)
                                              : readIndices<PolygonFan>(record, element, i, property);
                RETURN_IF_ERROR(done);
            }
            RETURN_IF_ERROR(endRecord(record, element, i));
        }
        return {};
    }

    template <typename Record>
    Result<void> readVertices(Record& record, const PlyElement& element) {
        if (const auto left = file_.remaining()) {
            sink_.reserve(std::min(element.count, *left / element.leastSize(header_.encoding)));
        }
        for (std::uint64_t i = 0; i < element.count; ++i) {
            if (!record.begin()) return fail(record.error(element, i, ""));
            Point3 p;
            for (std::size_t j = 0; j < element.properties.size(); ++j) {
                const PlyProperty& property = element.properties[j];
                double* axis = j == coordinates_[0]   ? &p.x
                               : j == coordinates_[1] ? &p.y
                               : j == coordinates_[2] ? &p.z
                                                      : nullptr;
                if (axis != nullptr) {
                    if (!record.real(property.type, *axis)) {
                        return fail(record.error(element, i, "the number " + property.name));
                    }
                } else
                    RETURN_IF_ERROR(skipProperty(file_, record, element, i, property));
            }
            RETURN_IF_ERROR(endRecord(record, element, i));
            if (!sink_.add(p)) return fail(sink_.refusal(p, record.where()));
        }
        return {};
    }

    template <typename Record>
    Result<void> readGuess(Record& record, const PlyElement& element, std::uint64_t index,
                           const PlyProperty& property) {
        const auto length = readLength(file_, record, element, index, property);
        RETURN_IF_ERROR(length);
        FaceGuess& guess = guesses_.back();
        guess.begin(*length);
        for (std::int64_t i = 0; i < *length; ++i) {
            std::int64_t vertex = 0;
            if (!record.integer(property.type, vertex))
                return fail(noEntry(record, element, index, property, i));
            guess.add(vertex);
        }
        guess.end();
        return {};
    }

    template <typename Record>
    Error noEntry(const Record& record, const PlyElement& element, std::uint64_t index,
                  const PlyProperty& property, std::int64_t entry) const {
        return record.error(element, index, "entry " + std::to_string(entry) + " of " + property.name);
    }

    // Triangles are made while the indices arrive, so the announced length of a list allocates nothing.
    template <typename Builder, typename Record>
    Result<void> readIndices(Record& record, const PlyElement& element, std::uint64_t index,
                             const PlyProperty& property) {
        const auto length = readLength(file_, record, element, index, property);
        RETURN_IF_ERROR(length);
        Builder builder(content_.triangles);
        builder.begin();
        for (std::int64_t i = 0; i < *length; ++i) {
            std::int64_t vertex = 0;
            if (!record.integer(property.type, vertex))
                return fail(noEntry(record, element, index, property, i));
            // -1 ends a strip and starts the next one in the same list.
            if (vertex == -1 && std::is_same_v<Builder, TriangleStrip>) {
                builder.begin();
                continue;
            }
            if (vertex < 0 || static_cast<std::uint64_t>(vertex) >= vertexCount_ ||
                vertex > std::numeric_limits<std::uint32_t>::max()) {
                return fail(
                    file_.malformed(record.where() + ": " + recordName(element, index) + " names vertex " +
                                    std::to_string(vertex) + ", but the file has " +
                                    countText(vertexCount_, "vertex", "vertices") + ", counted from 0"));
            }
            builder.add(static_cast<std::uint32_t>(vertex));
        }
        return {};
    }

    InputFile& file_;
    const PlyHeader& header_;
    ScanContent& content_;
    WordReader words_;
    bool wordByWord_ = false;
    VertexSink sink_;
    std::vector<FaceGuess> guesses_;
    std::array<std::size_t, 3> coordinates_ = {kNoProperty, kNoProperty, kNoProperty};
    std::uint64_t vertexCount_ = 0;
};

}  // namespace

Result<ScanContent> readPly(InputFile& file, std::size_t maxPoints) {
    const auto header = readPlyHeader(file);
    RETURN_IF_ERROR(header);
    ScanContent content;
    switch (header->encoding) {
        case PlyEncoding::kAscii: content.format = "PLY ASCII"; break;
        case PlyEncoding::kLittleEndian: content.format = "PLY binary little-endian"; break;
        case PlyEncoding::kBigEndian: content.format = "PLY binary big-endian"; break;
    }
    PlyBody body(file, *header, content, maxPoints);
    RETURN_IF_ERROR(body.read());
    return content;
}

}  // namespace shapedb::io
