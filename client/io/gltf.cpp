// SPDX-License-Identifier: Apache-2.0
// glTF 2.0: the triangles, strips, fans and points of the scene, where its nodes put them. Skins, morph
// targets, animations and materials do not change the shape at rest that is read.
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/io/affine.h"
#include "client/io/formats.h"
#include "client/io/gltf_document.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

using nlohmann::json;

namespace {

enum GltfMode : std::uint64_t { kPoints = 0, kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6 };

// `count` numbers, or nothing.
std::optional<std::vector<double>> numbersOf(const json& node, const char* name, std::size_t count) {
    const auto member = node.find(name);
    if (member == node.end() || !member->is_array() || member->size() != count) return std::nullopt;
    std::vector<double> numbers;
    for (const json& number : *member) {
        if (!number.is_number()) return std::nullopt;
        numbers.push_back(number.get<double>());
    }
    return numbers;
}

Affine motionOf(const json& node) {
    // By columns, the last row being 0 0 0 1.
    if (const auto m = numbersOf(node, "matrix", 16)) {
        const auto& v = *m;
        return {{Point3{v[0], v[4], v[8]}, Point3{v[1], v[5], v[9]}, Point3{v[2], v[6], v[10]}},
                {v[12], v[13], v[14]}};
    }
    Affine motion;
    if (const auto s = numbersOf(node, "scale", 3)) {
        motion.rows = {Point3{(*s)[0], 0, 0}, Point3{0, (*s)[1], 0}, Point3{0, 0, (*s)[2]}};
    }
    if (const auto q = numbersOf(node, "rotation", 4)) {
        const double x = (*q)[0], y = (*q)[1], z = (*q)[2], w = (*q)[3];
        const Affine turn = {{Point3{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                              Point3{2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                              Point3{2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}},
                             {}};
        motion = turn * motion;
    }
    if (const auto t = numbersOf(node, "translation", 3)) motion.shift = {(*t)[0], (*t)[1], (*t)[2]};
    return motion;
}

class GltfReader {
  public:
    GltfReader(InputFile& file, GltfDocument& document, std::size_t maxPoints)
        : document_(document), sink_(file, content_.vertices, maxPoints) {}

    Result<ScanContent> read() {
        content_.format = document_.format();
        const auto roots = findRoots();
        RETURN_IF_ERROR(roots);
        if (roots->empty()) RETURN_IF_ERROR(addLooseMeshes());
        RETURN_IF_ERROR(addNodes(*roots));
        if (content_.vertices.empty())
            return fail(document_.malformed("the scene has no mesh with vertices"));
        return std::move(content_);
    }

  private:
    struct Placed {
        std::uint64_t node;
        Affine motion;
    };

    std::size_t sizeOf(const char* name) const {
        const auto array = document_.root().find(name);
        return array != document_.root().end() && array->is_array() ? array->size() : 0;
    }

    // The nodes of the scene; without one all that are nobody's children.
    Result<std::vector<std::uint64_t>> findRoots() const {
        if (sizeOf("scenes") == 0) return nodesWithoutParent();
        const std::uint64_t number = wholeNumber(document_.root(), "scene").value_or(0);
        const auto scene = document_.element("scenes", number, "the document");
        RETURN_IF_ERROR(scene);
        return listOf(**scene, "nodes");
    }

    std::vector<std::uint64_t> nodesWithoutParent() const {
        std::vector<bool> child(sizeOf("nodes"));
        for (std::size_t i = 0; i < child.size(); ++i) {
            for (const std::uint64_t other : listOf(document_.root()["nodes"][i], "children")) {
                if (other < child.size()) child[other] = true;
            }
        }
        std::vector<std::uint64_t> roots;
        for (std::size_t i = 0; i < child.size(); ++i) {
            if (!child[i]) roots.push_back(i);
        }
        return roots;
    }

    static std::vector<std::uint64_t> listOf(const json& object, const char* name) {
        std::vector<std::uint64_t> list;
        const auto array = object.find(name);
        if (!object.is_object() || array == object.end() || !array->is_array()) return list;
        for (const json& entry : *array) {
            if (entry.is_number_unsigned()) list.push_back(entry.get<std::uint64_t>());
        }
        return list;
    }

    Result<void> addNodes(const std::vector<std::uint64_t>& roots) {
        std::vector<bool> visited(sizeOf("nodes"));
        std::vector<Placed> open;
        for (auto root = roots.rbegin(); root != roots.rend(); ++root) open.push_back({*root, {}});
        while (!open.empty()) {
            const Placed parent = open.back();
            open.pop_back();
            const std::string who = "nodes[" + std::to_string(parent.node) + "]";
            const auto node = document_.element("nodes", parent.node, "a scene or node");
            RETURN_IF_ERROR(node);
            if (visited[parent.node])
                return fail(document_.malformed(who + " is there twice; nodes form a tree"));
            visited[parent.node] = true;
            const Affine motion = parent.motion * motionOf(**node);
            if (const auto mesh = wholeNumber(**node, "mesh")) RETURN_IF_ERROR(addMesh(*mesh, motion, who));
            const auto children = listOf(**node, "children");
            for (auto child = children.rbegin(); child != children.rend(); ++child)
                open.push_back({*child, motion});
        }
        return {};
    }

    Result<void> addLooseMeshes() {
        if (sizeOf("nodes") > 0) return {};
        for (std::size_t i = 0; i < sizeOf("meshes"); ++i) RETURN_IF_ERROR(addMesh(i, {}, "the document"));
        return {};
    }

    Result<void> addMesh(std::uint64_t index, const Affine& motion, const std::string& who) {
        const auto mesh = document_.element("meshes", index, who);
        RETURN_IF_ERROR(mesh);
        const auto primitives = (*mesh)->find("primitives");
        if (primitives == (*mesh)->end() || !primitives->is_array()) {
            return fail(document_.malformed("meshes[" + std::to_string(index) + "] has no primitives"));
        }
        // Primitives of a mesh may share their vertices.
        std::map<std::uint64_t, VertexRange> added;
        for (const json& primitive : *primitives) {
            RETURN_IF_ERROR(addPrimitive(primitive, motion, "meshes[" + std::to_string(index) + "]", added));
        }
        return {};
    }

    struct VertexRange {
        std::uint64_t first = 0;
        std::uint64_t count = 0;
    };

    Result<void> addPrimitive(const json& primitive, const Affine& motion, const std::string& who,
                              std::map<std::uint64_t, VertexRange>& added) {
        const auto attributes = primitive.find("attributes");
        if (!primitive.is_object() || attributes == primitive.end()) {
            return fail(document_.malformed(who + " has a primitive without attributes"));
        }
        const auto accessor = wholeNumber(*attributes, "POSITION");
        if (!accessor) return {};  // allowed, and nothing to see
        auto place = added.find(*accessor);
        if (place == added.end()) {
            const auto range = addVertices(*accessor, motion, who);
            RETURN_IF_ERROR(range);
            place = added.emplace(*accessor, *range).first;
        }
        const std::uint64_t mode = wholeNumber(primitive, "mode").value_or(kTriangles);
        if (mode != kTriangles && mode != kTriangleStrip && mode != kTriangleFan) return {};
        std::vector<std::uint32_t> corners;
        if (const auto indices = wholeNumber(primitive, "indices")) {
            auto read = document_.indices(*indices);
            RETURN_IF_ERROR(read);
            corners = std::move(*read);
        } else {
            for (std::uint64_t i = 0; i < place->second.count; ++i)
                corners.push_back(static_cast<std::uint32_t>(i));
        }
        return addTriangles(corners, mode, place->second, who);
    }

    Result<VertexRange> addVertices(std::uint64_t accessor, const Affine& motion, const std::string& who) {
        const auto points = document_.positions(accessor);
        RETURN_IF_ERROR(points);
        const VertexRange range = {content_.vertices.size(), points->size()};
        if (tooManyCopies(range.first + range.count, document_.bytesRead())) {
            return fail(document_.malformed(who + ": too many copies of its meshes"));
        }
        for (const Point3& p : *points) {
            const Point3 placed = motion(p);
            if (!sink_.add(placed)) return fail(sink_.refusal(placed, who));
        }
        return range;
    }

    Result<void> addTriangles(const std::vector<std::uint32_t>& corners, std::uint64_t mode,
                              const VertexRange& range, const std::string& who) {
        PolygonFan fan(content_.triangles);
        TriangleStrip strip(content_.triangles);
        fan.begin();
        strip.begin();
        if (tooManyCopies(content_.triangles.size() + corners.size(), document_.bytesRead())) {
            return fail(document_.malformed(who + ": too many copies of its triangles"));
        }
        if (mode == kTriangles && corners.size() % 3 != 0) {
            return fail(document_.malformed(who + " has a triangle without three corners"));
        }
        for (std::size_t i = 0; i < corners.size(); ++i) {
            if (corners[i] >= range.count) {
                return fail(document_.malformed(who + " names vertex " + std::to_string(corners[i]) +
                                                ", but has " + countText(range.count, "vertex", "vertices") +
                                                ", counted from 0"));
            }
            if (mode == kTriangles && i % 3 == 0) fan.begin();
            const auto vertex = static_cast<std::uint32_t>(range.first + corners[i]);
            mode == kTriangleStrip ? strip.add(vertex) : fan.add(vertex);
        }
        return {};
    }

    GltfDocument& document_;
    ScanContent content_;
    VertexSink sink_;
};

}  // namespace

Result<ScanContent> readGltf(InputFile& file, std::size_t maxPoints) {
    auto document = GltfDocument::read(file);
    RETURN_IF_ERROR(document);
    return GltfReader(file, *document, maxPoints).read();
}

}  // namespace shapedb::io
