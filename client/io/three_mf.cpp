// SPDX-License-Identifier: Apache-2.0
// 3MF: the meshes that the build of the package places, with components and parts of their own (production
// extension). Read with libzip and Expat rather than lib3mf, so that the bounds on what unpacks and on copies
// are ours.
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <expat.h>

#include "client/io/affine.h"
#include "client/io/formats.h"
#include "client/io/text.h"
#include "client/io/zip_archive.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

/// An object placed by a build or in another object.
struct ThreeMfPlacement {
    std::string part;  ///< of the package; empty: the part that says so
    std::uint64_t object = 0;
    Affine motion;
};

struct ThreeMfObject {
    PointCloud vertices;
    std::vector<Triangle> triangles;
    std::vector<ThreeMfPlacement> components;
    bool isSupport = false;  ///< of the print, not of the thing
};

struct ThreeMfPart {
    std::map<std::uint64_t, ThreeMfObject> objects;
    std::vector<ThreeMfPlacement> build;
};

class Attributes {
  public:
    explicit Attributes(const XML_Char** pairs) : pairs_(pairs) {}

    /// Empty if there is none. Prefixes of names do not count.
    std::string_view operator[](std::string_view name) const {
        for (const XML_Char** pair = pairs_; *pair != nullptr; pair += 2) {
            const std::string_view full = pair[0];
            if (full.substr(full.rfind(':') + 1) == name) return pair[1];
        }
        return {};
    }

  private:
    const XML_Char** pairs_;
};

std::string_view localName(std::string_view name) { return name.substr(name.rfind(':') + 1); }

std::string withoutSlash(std::string_view part) {
    if (!part.empty() && part.front() == '/') part.remove_prefix(1);
    return std::string(part);
}

// Twelve numbers: the rows of a matrix that points are multiplied with from the left, the last row the shift.
std::optional<Affine> parseTransform(std::string_view text) {
    if (isBlankLine(text)) return Affine{};
    std::array<double, 12> m = {};
    for (double& number : m) {
        if (!parseReal(nextWord(text), number)) return std::nullopt;
    }
    if (!isBlankLine(text)) return std::nullopt;
    return Affine{{Point3{m[0], m[3], m[6]}, Point3{m[1], m[4], m[7]}, Point3{m[2], m[5], m[8]}},
                  {m[9], m[10], m[11]}};
}

/// Takes one XML part of the package in.
class ThreeMfParser {
  public:
    ThreeMfParser(const InputFile& file, std::string name) : file_(file), name_(std::move(name)) {}

    Result<void> read(ZipArchive& archive) {
        const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(::XML_ParserCreate(nullptr),
                                                                             ::XML_ParserFree);
        if (parser == nullptr) throw std::bad_alloc();
        parser_ = parser.get();
        ::XML_SetUserData(parser_, this);
        ::XML_SetElementHandler(parser_, onBegin, onEnd);
        // Entities of a document's own are of no use here but to bombs.
        ::XML_SetStartDoctypeDeclHandler(parser_, onDoctype);
        RETURN_IF_ERROR(archive.visit(name_, [&](std::string_view text) { return take(text, false); }));
        return take({}, true);
    }

    ThreeMfPart part;
    std::string model;  ///< what a part of relationships names as the root model

  private:
    Result<void> take(std::string_view text, bool last) {
        const XML_Status status =
            ::XML_Parse(parser_, text.data(), static_cast<int>(text.size()), last ? 1 : 0);
        if (outOfMemory_) throw std::bad_alloc();
        if (error_) return fail(*error_);
        if (status == XML_STATUS_OK) return {};
        return fail(
            error(std::string("the XML is damaged: ") + ::XML_ErrorString(::XML_GetErrorCode(parser_))));
    }

    Error error(const std::string& what) const {
        return file_.malformed(inQuotes(name_) + " line " +
                               std::to_string(::XML_GetCurrentLineNumber(parser_)) + ": " + what);
    }

    void stop(const std::string& what) {
        if (!error_) error_ = error(what);
        ::XML_StopParser(parser_, XML_FALSE);
    }

    // Exceptions must not pass through Expat.
    template <typename Work>
    static void guarded(void* user, const Work& work) {
        auto& self = *static_cast<ThreeMfParser*>(user);
        try {
            work(self);
        } catch (const std::bad_alloc&) {
            self.outOfMemory_ = true;
            ::XML_StopParser(self.parser_, XML_FALSE);
        }
    }
    static void XMLCALL onBegin(void* user, const XML_Char* name, const XML_Char** attributes) {
        guarded(user, [&](ThreeMfParser& self) { self.begin(localName(name), Attributes(attributes)); });
    }
    static void XMLCALL onEnd(void* user, const XML_Char* name) {
        guarded(user, [&](ThreeMfParser& self) { self.end(localName(name)); });
    }
    static void XMLCALL onDoctype(void* user, const XML_Char*, const XML_Char*, const XML_Char*, int) {
        guarded(user, [&](ThreeMfParser& self) { self.stop("a document type is not read"); });
    }

    void begin(std::string_view name, const Attributes& attributes) {
        if (name == "object") {
            beginObject(attributes);
        } else if (name == "mesh") {
            inMesh_ = object_ != nullptr;
        } else if (name == "vertex" && inMesh_) {
            addVertex(attributes);
        } else if (name == "triangle" && inMesh_) {
            addTriangle(attributes);
        } else if (name == "component" && object_ != nullptr) {
            place(attributes, object_->components);
        } else if (name == "item") {
            place(attributes, part.build);
        } else if (name == "Relationship" && model.empty()) {
            const std::string_view type = attributes["Type"];
            if (type.substr(type.rfind('/') + 1) == "3dmodel") model = withoutSlash(attributes["Target"]);
        }
    }

    void end(std::string_view name) {
        if (name == "mesh") inMesh_ = false;
        if (name == "object") object_ = nullptr;
    }

    void beginObject(const Attributes& attributes) {
        std::uint64_t id = 0;
        if (!parseCount(attributes["id"], id)) return stop("an object has no id");
        const auto [place, isNew] = part.objects.try_emplace(id);
        if (!isNew) return stop("object " + std::to_string(id) + " is there twice");
        object_ = &place->second;
        const std::string_view type = attributes["type"];
        object_->isSupport = type == "support" || type == "solidsupport";
    }

    void addVertex(const Attributes& attributes) {
        Point3 p;
        const std::array<std::pair<const char*, double*>, 3> coordinates = {
            {{"x", &p.x}, {"y", &p.y}, {"z", &p.z}}};
        for (const auto& [name, value] : coordinates) {
            if (!parseReal(attributes[name], *value)) {
                return stop(std::string("expected the number ") + name + " of a vertex, found " +
                            inQuotesNotANumber(attributes[name]));
            }
        }
        object_->vertices.push_back(p);
    }

    void addTriangle(const Attributes& attributes) {
        Triangle triangle = {};
        constexpr std::array<const char*, 3> kNames = {"v1", "v2", "v3"};
        for (std::size_t i = 0; i < 3; ++i) {
            std::uint64_t vertex = 0;
            if (!parseCount(attributes[kNames[i]], vertex) || vertex >= object_->vertices.size()) {
                return stop(std::string("expected the vertex ") + kNames[i] + " of a triangle, found " +
                            inQuotes(attributes[kNames[i]]) + ", but the mesh has " +
                            countText(object_->vertices.size(), "vertex", "vertices"));
            }
            triangle[i] = static_cast<std::uint32_t>(vertex);
        }
        object_->triangles.push_back(triangle);
    }

    void place(const Attributes& attributes, std::vector<ThreeMfPlacement>& list) {
        ThreeMfPlacement placement;
        const auto motion = parseTransform(attributes["transform"]);
        if (!parseCount(attributes["objectid"], placement.object))
            return stop("an item or component has no objectid");
        if (!motion)
            return stop("a transform needs twelve numbers, found " + inQuotes(attributes["transform"]));
        placement.motion = *motion;
        placement.part = withoutSlash(attributes["path"]);
        list.push_back(std::move(placement));
    }

    const InputFile& file_;
    std::string name_;
    XML_Parser parser_ = nullptr;
    ThreeMfObject* object_ = nullptr;
    bool inMesh_ = false;
    bool outOfMemory_ = false;
    std::optional<Error> error_;
};

class ThreeMfReader {
  public:
    ThreeMfReader(InputFile& file, ZipArchive& archive, std::size_t maxPoints)
        : file_(file), archive_(archive), sink_(file, content_.vertices, maxPoints) {}

    Result<ScanContent> read() {
        content_.format = "3MF";
        const auto root = findModel();
        RETURN_IF_ERROR(root);
        const auto part = partOf(*root);
        RETURN_IF_ERROR(part);
        std::vector<ThreeMfPlacement> build = (*part)->build;
        if (build.empty()) {
            for (const auto& [id, object] : (*part)->objects) build.push_back({"", id, {}});
        }
        for (ThreeMfPlacement& item : build) {
            if (item.part.empty()) item.part = *root;
            RETURN_IF_ERROR(add(item));
        }
        if (content_.vertices.empty()) return fail(file_.malformed("the build of the package has no mesh"));
        return std::move(content_);
    }

  private:
    // Components of components; what refers to itself has no end.
    static constexpr std::size_t kGreatestDepth = 64;
    static constexpr std::uint64_t kMostPlacements = 1'000'000;

    Result<std::string> findModel() {
        const std::string usual = "3D/3dmodel.model";
        if (archive_.has("_rels/.rels")) {
            ThreeMfParser relationships(file_, "_rels/.rels");
            RETURN_IF_ERROR(relationships.read(archive_));
            if (!relationships.model.empty()) return relationships.model;
        }
        if (archive_.has(usual)) return usual;
        return fail(file_.malformed("the archive has no 3D model; this is not a 3MF file"));
    }

    Result<const ThreeMfPart*> partOf(const std::string& name) {
        const auto known = parts_.find(name);
        if (known != parts_.end()) return &known->second;
        ThreeMfParser parser(file_, name);
        RETURN_IF_ERROR(parser.read(archive_));
        return &parts_.emplace(name, std::move(parser.part)).first->second;
    }

    Result<void> add(const ThreeMfPlacement& item) {
        std::vector<std::pair<ThreeMfPlacement, std::size_t>> open = {{item, 0}};
        while (!open.empty()) {
            const auto [here, depth] = std::move(open.back());
            open.pop_back();
            const std::string who = inQuotes(here.part) + " object " + std::to_string(here.object);
            const auto part = partOf(here.part);
            RETURN_IF_ERROR(part);
            const auto found = (*part)->objects.find(here.object);
            if (found == (*part)->objects.end())
                return fail(file_.malformed(who + " is placed, but does not exist"));
            const ThreeMfObject& object = found->second;
            if (depth > kGreatestDepth) return fail(file_.malformed(who + " is a component of itself"));
            if (object.isSupport) continue;
            if (++placements_ > kMostPlacements ||
                tooManyCopies(content_.vertices.size() + object.vertices.size(), archive_.packedBytes()) ||
                tooManyCopies(content_.triangles.size() + object.triangles.size(), archive_.packedBytes())) {
                return fail(file_.malformed(who + ": too many copies of objects"));
            }
            RETURN_IF_ERROR(addMesh(object, here.motion, who));
            for (auto component = object.components.rbegin(); component != object.components.rend();
                 ++component) {
                open.push_back({{component->part.empty() ? here.part : component->part, component->object,
                                 here.motion * component->motion},
                                depth + 1});
            }
        }
        return {};
    }

    Result<void> addMesh(const ThreeMfObject& object, const Affine& motion, const std::string& who) {
        const auto first = static_cast<std::uint32_t>(content_.vertices.size());
        for (const Point3& p : object.vertices) {
            const Point3 placed = motion(p);
            if (!sink_.add(placed)) return fail(sink_.refusal(placed, who));
        }
        for (const Triangle& t : object.triangles) {
            PolygonFan fan(content_.triangles);
            fan.begin();
            for (const std::uint32_t vertex : t) fan.add(first + vertex);
        }
        return {};
    }

    InputFile& file_;
    ZipArchive& archive_;
    ScanContent content_;
    VertexSink sink_;
    std::map<std::string, ThreeMfPart> parts_;
    std::uint64_t placements_ = 0;
};

}  // namespace

Result<ScanContent> read3mf(InputFile& file, std::size_t maxPoints) {
    auto archive = ZipArchive::read(file);
    RETURN_IF_ERROR(archive);
    return ThreeMfReader(file, *archive, maxPoints).read();
}

}  // namespace shapedb::io
