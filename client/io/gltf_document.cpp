// SPDX-License-Identifier: Apache-2.0
// Not tinygltf: the names of files in a stranger's document and the bounds of accessors would have to be
// checked beside it all the same, and the images that it decodes are not needed.
#include "client/io/gltf_document.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <utility>

#include "client/io/scalar.h"
#include "client/io/text.h"
#include "core/base/count_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

using nlohmann::json;

namespace {

constexpr std::uint32_t kMagic = 0x46546c67;        // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004e4942;  // "BIN"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;
constexpr std::size_t kLongestPath = 1000;

// A parsed document takes many times its text. Those of scans have a few kilobytes, but may hold their
// buffers as base64.
constexpr std::size_t kMostText = std::size_t{512} << 20;

std::uint32_t loadUint32(const char* bytes) { return loadAs<std::uint32_t>(bytes, !machineIsLittleEndian()); }

std::optional<ScalarType> componentTypeOf(std::uint64_t number) {
    switch (number) {
        case 5120: return ScalarType::kInt8;
        case 5121: return ScalarType::kUint8;
        case 5122: return ScalarType::kInt16;
        case 5123: return ScalarType::kUint16;
        case 5125: return ScalarType::kUint32;
        case 5126: return ScalarType::kFloat32;
        default: return std::nullopt;
    }
}

// What the integers of a type stand for when they are normalized, from -1 or 0 to 1.
double greatestOf(ScalarType type) {
    switch (type) {
        case ScalarType::kInt8: return 127.0;
        case ScalarType::kUint8: return 255.0;
        case ScalarType::kInt16: return 32767.0;
        case ScalarType::kUint16: return 65535.0;
        case ScalarType::kUint32: return 4294967295.0;
        default: return 1.0;
    }
}

// Extensions that change what the triangles are, unlike those of materials. The others of the standard may be
// required and are no reason to refuse a file.
bool changesGeometry(const std::string& extension) {
    for (const char* harmless :
         {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_", "KHR_lights_", "KHR_xmp",
          "KHR_mesh_quantization", "KHR_animation_", "KHR_technique", "EXT_lights_"}) {
        if (extension.rfind(harmless, 0) == 0) return false;
    }
    return true;
}

// Nothing if a character is none of base64.
std::optional<std::string> decodeBase64(std::string_view text) {
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    std::uint32_t bits = 0;
    int count = 0;
    while (!text.empty() && text.back() == '=') text.remove_suffix(1);
    for (const char c : text) {
        std::uint32_t value = 0;
        if (c >= 'A' && c <= 'Z') {
            value = static_cast<std::uint32_t>(c - 'A');
        } else if (c >= 'a' && c <= 'z') {
            value = static_cast<std::uint32_t>(c - 'a' + 26);
        } else if (c >= '0' && c <= '9') {
            value = static_cast<std::uint32_t>(c - '0' + 52);
        } else if (c == '+' || c == '-') {
            value = 62;
        } else if (c == '/' || c == '_') {
            value = 63;
        } else {
            return std::nullopt;
        }
        bits = (bits << 6) | value;
        if (++count % 4 != 1) bytes += static_cast<char>((bits >> (6 - 2 * ((count - 1) % 4))) & 0xffU);
    }
    return bytes;
}

std::string decodePercent(std::string_view uri) {
    const auto hex = [](char c) {
        const std::string_view digits = "0123456789abcdef";
        return digits.find(lowerCase({&c, 1})[0]);
    };
    std::string path;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const bool escaped =
            uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) < 16 && hex(uri[i + 2]) < 16;
        path += escaped ? static_cast<char>(16 * hex(uri[i + 1]) + hex(uri[i + 2])) : uri[i];
        if (escaped) i += 2;
    }
    return path;
}

// A path below the folder of the document. What a stranger's document names must not be any file of this
// machine.
bool staysBelow(const std::filesystem::path& path) {
    if (path.empty() || path.is_absolute()) return false;
    for (const auto& part : path) {
        if (part == "..") return false;
    }
    const std::string& name = path.native();
    return name.size() <= kLongestPath && std::none_of(name.begin(), name.end(), [](unsigned char c) {
               return c < ' ' || c == '\x7f' || c == ':';
           });
}

// Whatever is left of the file; nothing if that is more than `most`.
std::optional<std::string> readRest(InputFile& file, std::size_t most) {
    std::string bytes;
    while (!file.peek(1).empty()) {
        if (file.available() > most - bytes.size()) return std::nullopt;
        bytes.append(file.data(), file.available());
        file.consume(file.available());
    }
    return bytes;
}

}  // namespace

std::optional<std::uint64_t> wholeNumber(const json& object, const char* name) {
    if (!object.is_object()) return std::nullopt;
    const auto member = object.find(name);
    if (member == object.end()) return std::nullopt;
    if (member->is_number_unsigned()) return member->get<std::uint64_t>();
    // Some programs write "3.0".
    if (!member->is_number_float()) return std::nullopt;
    const auto value = member->get<double>();
    if (!(value >= 0.0) || value > 1e15) return std::nullopt;
    const auto whole = static_cast<std::uint64_t>(value);
    return static_cast<double>(whole) == value ? std::optional<std::uint64_t>(whole) : std::nullopt;
}

Error GltfDocument::malformed(const std::string& what) const { return file_->malformed(what); }

Result<GltfDocument> GltfDocument::read(InputFile& file) {
    GltfDocument document(file);
    const bool container = file.fill(kHeaderBytes) && loadUint32(file.data()) == kMagic;
    if (!container) file.decodeText();
    auto bytes = readRest(file, container ? std::numeric_limits<std::size_t>::max() : kMostText);
    if (!bytes) return fail(document.malformed("a glTF document of more than 512 MiB; save it as .glb"));
    document.bytesRead_ = bytes->size();
    document.format_ = container ? "glTF binary" : "glTF";
    RETURN_IF_ERROR(container ? document.readContainer(std::move(*bytes)) : document.parse(*bytes));
    return document;
}

Result<void> GltfDocument::readContainer(std::string&& bytes) {
    const std::uint32_t version = loadUint32(bytes.data() + 4);
    const std::uint64_t length = loadUint32(bytes.data() + 8);
    if (version != 2) {
        return fail(malformed("byte 4: glTF version " + std::to_string(version) +
                              " is not read, only 2; convert the file"));
    }
    if (length > bytes.size()) {
        return fail(malformed("byte 8: the file is cut short: it has " + countText(bytes.size(), "byte") +
                              " of " + std::to_string(length)));
    }
    if (bytes.find_first_not_of('\0', length) != std::string::npos) {
        return fail(malformed("byte " + std::to_string(length) + ": data after the announced end"));
    }
    std::size_t at = kHeaderBytes;
    bool hasText = false;
    while (at + kChunkHeaderBytes <= length) {
        const std::uint64_t size = loadUint32(bytes.data() + at);
        const std::uint32_t type = loadUint32(bytes.data() + at + 4);
        const std::string place = "byte " + std::to_string(at) + ": ";
        at += kChunkHeaderBytes;
        if (size > length - at) return fail(malformed(place + "a chunk that is longer than the file"));
        if (!hasText) {
            if (type != kJsonChunk) return fail(malformed(place + "expected the JSON chunk"));
            if (size > kMostText) return fail(malformed(place + "a JSON chunk of more than 512 MiB"));
            RETURN_IF_ERROR(parse(std::string_view(bytes).substr(at, size)));
            hasText = true;
        } else if (type == kBinaryChunk && !binaryChunk_) {
            binaryChunk_ = bytes.substr(at, size);
        }
        at += size;
    }
    if (!hasText) return fail(malformed("byte 12: expected the JSON chunk, found the end of the file"));
    return {};
}

Result<void> GltfDocument::parse(std::string_view text) {
    while (!text.empty() && (text.back() == '\0' || isBlank(text.back()))) text.remove_suffix(1);
    root_ = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (root_.is_discarded() || !root_.is_object()) {
        return fail(
            malformed("the JSON text of a glTF document expected, which is damaged or something else"));
    }
    const auto asset = root_.find("asset");
    const bool named = asset != root_.end() && asset->is_object() && asset->contains("version") &&
                       (*asset)["version"].is_string();
    const std::string version = named ? (*asset)["version"].get<std::string>() : "";
    if (version.substr(0, 2) != "2.") {
        return fail(
            malformed("asset.version is " + inQuotes(version) + "; only glTF 2 is read: convert the file"));
    }
    return checkExtensions();
}

Result<void> GltfDocument::checkExtensions() const {
    const auto required = root_.find("extensionsRequired");
    if (required == root_.end() || !required->is_array()) return {};
    for (const json& extension : *required) {
        if (!extension.is_string() || !changesGeometry(extension.get<std::string>())) continue;
        return fail(malformed("the file needs the extension " + inQuotes(extension.get<std::string>()) +
                              ", which is not read; save it without (compression)"));
    }
    return {};
}

Result<const json*> GltfDocument::element(const char* name, std::uint64_t index,
                                          const std::string& who) const {
    const auto array = root_.find(name);
    if (array != root_.end() && array->is_array() && index < array->size() && (*array)[index].is_object()) {
        return &(*array)[index];
    }
    return fail(malformed(who + " names " + name + "[" + std::to_string(index) + "], which does not exist"));
}

Result<const std::string*> GltfDocument::buffer(std::uint64_t index) {
    const auto known = buffers_.find(index);
    if (known != buffers_.end()) return &known->second;
    const auto description = element("buffers", index, "a buffer view");
    RETURN_IF_ERROR(description);
    auto bytes = loadBuffer(**description, index);
    RETURN_IF_ERROR(bytes);
    const auto length = wholeNumber(**description, "byteLength");
    if (!length || *length > bytes->size()) {
        return fail(malformed("buffers[" + std::to_string(index) + "] is cut short: it has " +
                              countText(bytes->size(), "byte") + " of " +
                              (length ? std::to_string(*length) : "an unknown number")));
    }
    bytes->resize(static_cast<std::size_t>(*length));
    return &buffers_.emplace(index, std::move(*bytes)).first->second;
}

Result<std::string> GltfDocument::loadBuffer(const json& buffer, std::uint64_t index) {
    const std::string who = "buffers[" + std::to_string(index) + "]";
    const auto member = buffer.find("uri");
    if (member == buffer.end()) {
        if (index == 0 && binaryChunk_) return *std::move(binaryChunk_);
        return fail(malformed(who + " has no data"));
    }
    if (!member->is_string()) return fail(malformed(who + ".uri is not text"));
    const auto& uri = member->get_ref<const std::string&>();
    if (uri.rfind("data:", 0) != 0) return loadFile(uri, who);
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos || uri.rfind(";base64", comma) == std::string::npos) {
        return fail(malformed(who + ".uri is data, but not base64"));
    }
    auto bytes = decodeBase64(std::string_view(uri).substr(comma + 1));
    if (!bytes) return fail(malformed(who + ".uri is no base64"));
    return std::move(*bytes);
}

Result<std::string> GltfDocument::loadFile(const std::string& uri, const std::string& who) {
    const std::filesystem::path path = decodePercent(uri);
    if (!staysBelow(path)) {
        return fail(malformed(who + " is in the file " + inQuotes(uri) +
                              ", which is not below the folder of the document and is not read"));
    }
    if (file_->isStandardInput()) {
        return fail(malformed(who + " is in the file " + inQuotes(uri) +
                              "; give the document by its name, or as .glb"));
    }
    auto other = InputFile::open((std::filesystem::path(file_->path()).parent_path() / path).string(),
                                 file_->context());
    if (!other) return fail(withContext(other.error(), file_->path() + ": " + who + ": "));
    auto bytes = readRest(*other, std::numeric_limits<std::size_t>::max());
    if (other->failure()) return fail(*other->failure());
    bytesRead_ += bytes->size();
    return std::move(*bytes);
}

Result<GltfDocument::View> GltfDocument::view(std::uint64_t index) {
    const std::string who = "bufferViews[" + std::to_string(index) + "]";
    const auto description = element("bufferViews", index, "an accessor");
    RETURN_IF_ERROR(description);
    const auto number = wholeNumber(**description, "buffer");
    const auto length = wholeNumber(**description, "byteLength");
    if (!number || !length) return fail(malformed(who + " has no buffer or no byteLength"));
    const std::uint64_t offset = wholeNumber(**description, "byteOffset").value_or(0);
    const auto bytes = buffer(*number);
    RETURN_IF_ERROR(bytes);
    if (offset > (*bytes)->size() || *length > (*bytes)->size() - offset) {
        return fail(malformed(who + " reaches beyond the end of its buffer of " +
                              countText((*bytes)->size(), "byte")));
    }
    return View{std::string_view(**bytes).substr(offset, *length),
                wholeNumber(**description, "byteStride").value_or(0)};
}

Result<GltfDocument::Layout> GltfDocument::layout(const json& accessor, const std::string& who,
                                                  std::uint64_t components) const {
    Layout layout;
    const auto count = wholeNumber(accessor, "count");
    const auto type = wholeNumber(accessor, "componentType");
    const auto scalar = type ? componentTypeOf(*type) : std::nullopt;
    const auto name = accessor.find("type");
    const char* expected = components == 3 ? "VEC3" : "SCALAR";
    if (!count || !scalar || name == accessor.end() || *name != expected) {
        return fail(malformed(who + " needs a count, a componentType and the type " + expected));
    }
    layout.count = *count;
    layout.components = components;
    layout.componentType = *type;
    layout.componentSize = scalarSize(*scalar);
    const auto normalized = accessor.find("normalized");
    layout.normalized = normalized != accessor.end() && *normalized == true;
    return layout;
}

Result<void> GltfDocument::readDense(const json& holder, const Layout& layout, const std::string& who,
                                     std::vector<double>& values) {
    const auto viewIndex = wholeNumber(holder, "bufferView");
    if (!viewIndex) return fail(malformed(who + " has no bufferView"));
    const auto where = view(*viewIndex);
    RETURN_IF_ERROR(where);
    const std::uint64_t offset = wholeNumber(holder, "byteOffset").value_or(0);
    const std::uint64_t stride = where->stride != 0 ? where->stride : layout.elementSize();
    const std::uint64_t size = where->bytes.size();
    // The last element needs no whole stride.
    if (stride < layout.elementSize()) return fail(malformed(who + " has elements that overlap"));
    const bool fits =
        layout.count == 0 || (offset <= size && layout.elementSize() <= size - offset &&
                              layout.count - 1 <= (size - offset - layout.elementSize()) / stride);
    if (!fits) {
        return fail(malformed(who + " has " + countText(layout.count, "element") +
                              ", which reach beyond its buffer view of " + countText(size, "byte")));
    }
    const ScalarType type = *componentTypeOf(layout.componentType);
    values.reserve(static_cast<std::size_t>(layout.count * layout.components));
    for (std::uint64_t i = 0; i < layout.count; ++i) {
        for (std::uint64_t c = 0; c < layout.components; ++c) {
            const double value =
                loadScalar(where->bytes.data() + offset + i * stride + c * layout.componentSize, type,
                           !machineIsLittleEndian());
            values.push_back(layout.normalized && !isFloating(type) ? value / greatestOf(type) : value);
        }
    }
    return {};
}

Result<void> GltfDocument::readSparse(const json& sparse, const Layout& layout, const std::string& who,
                                      std::vector<double>& values) {
    const auto count = wholeNumber(sparse, "count");
    if (!count || !sparse.contains("indices") || !sparse.contains("values")) {
        return fail(malformed(who + ".sparse needs a count, indices and values"));
    }
    const auto type = wholeNumber(sparse["indices"], "componentType");
    if (!type || !componentTypeOf(*type))
        return fail(malformed(who + ".sparse.indices has no componentType"));
    Layout places;
    places.count = *count;
    places.componentType = *type;
    places.componentSize = scalarSize(*componentTypeOf(*type));
    std::vector<double> at;
    RETURN_IF_ERROR(readDense(sparse["indices"], places, who + ".sparse.indices", at));
    Layout changed = layout;
    changed.count = *count;
    std::vector<double> other;
    RETURN_IF_ERROR(readDense(sparse["values"], changed, who + ".sparse.values", other));
    for (std::size_t i = 0; i < at.size(); ++i) {
        if (!(at[i] >= 0.0) || at[i] >= static_cast<double>(layout.count)) {
            return fail(malformed(who + ".sparse names an element that it does not have"));
        }
        for (std::uint64_t c = 0; c < layout.components; ++c) {
            values[static_cast<std::size_t>(at[i]) * layout.components + c] =
                other[i * layout.components + c];
        }
    }
    return {};
}

Result<std::vector<double>> GltfDocument::values(std::uint64_t index, std::uint64_t components) {
    const std::string who = "accessors[" + std::to_string(index) + "]";
    const auto accessor = element("accessors", index, "a mesh");
    RETURN_IF_ERROR(accessor);
    const auto form = layout(**accessor, who, components);
    RETURN_IF_ERROR(form);
    const auto sparse = (*accessor)->find("sparse");
    const bool isSparse = sparse != (*accessor)->end();
    std::vector<double> values;
    if ((*accessor)->contains("bufferView")) {
        RETURN_IF_ERROR(readDense(**accessor, *form, who, values));
    } else {
        // All zero but for the sparse ones: nothing but the file's size bounds their number.
        if (!isSparse || form->count > bytesRead_) return fail(malformed(who + " has no data"));
        values.resize(static_cast<std::size_t>(form->count * components));
    }
    if (isSparse) RETURN_IF_ERROR(readSparse(*sparse, *form, who, values));
    return values;
}

Result<std::vector<Point3>> GltfDocument::positions(std::uint64_t accessor) {
    const auto numbers = values(accessor, 3);
    RETURN_IF_ERROR(numbers);
    std::vector<Point3> points;
    points.reserve(numbers->size() / 3);
    for (std::size_t i = 0; i + 2 < numbers->size(); i += 3) {
        points.push_back({(*numbers)[i], (*numbers)[i + 1], (*numbers)[i + 2]});
    }
    return points;
}

Result<std::vector<std::uint32_t>> GltfDocument::indices(std::uint64_t accessor) {
    const auto numbers = values(accessor, 1);
    RETURN_IF_ERROR(numbers);
    std::vector<std::uint32_t> indices;
    indices.reserve(numbers->size());
    for (const double number : *numbers) {
        if (!(number >= 0.0) || number > std::numeric_limits<std::uint32_t>::max()) {
            return fail(malformed("accessors[" + std::to_string(accessor) + "] has an index that is none"));
        }
        indices.push_back(static_cast<std::uint32_t>(number));
    }
    return indices;
}

}  // namespace shapedb::io
