// SPDX-License-Identifier: Apache-2.0
#include "client/io/kind_of_content.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "client/io/scalar.h"
#include "client/io/text.h"

namespace shapedb::io {

namespace {

using KindWords = std::vector<std::string_view>;

constexpr std::uint64_t kStlHeaderBytes = 84;
constexpr std::uint64_t kStlTriangleBytes = 50;

constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kKindNames = {
    {{".ply", "a PLY file"},
     {".pcd", "a PCD file"},
     {".off", "an OFF file"},
     {".obj", "an OBJ file"},
     {".stl", "an STL file"},
     {".las", "a LAS file"},
     {".gltf", "a glTF file"},
     {".glb", "a glTF file"},
     {".3mf", "a 3MF file"},
     {".xyz", "text with a point on each line"}}};

bool isOneOf(std::string_view word, std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

bool holds(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

KindWords wordsOf(std::string_view line) {
    KindWords words;
    for (std::string_view word = nextWord(line); !word.empty(); word = nextWord(line)) words.push_back(word);
    return words;
}

// Without what marks UTF-8 and UTF-16.
std::string textOf(std::string_view head) {
    for (const std::string_view mark : {"\xEF\xBB\xBF", "\xFF\xFE", "\xFE\xFF"}) {
        if (head.substr(0, mark.size()) != mark) continue;
        head.remove_prefix(mark.size());
        break;
    }
    std::string text(head);
    if (head.substr(0, 2).find('\0') != std::string_view::npos) {
        text.erase(std::remove(text.begin(), text.end(), '\0'), text.end());
    }
    return text;
}

std::vector<std::string_view> linesOf(std::string_view text) {
    std::vector<std::string_view> lines;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        lines.push_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return lines;
}

bool beginsWithAPoint(const KindWords& words, std::size_t from = 0) {
    double value = 0.0;
    return words.size() >= from + 3 && parseReal(words[from], value) && parseReal(words[from + 1], value) &&
           parseReal(words[from + 2], value);
}

// "OFF", "STCNOFF", "OFF BINARY", "OFF 8 6 12", "OFF8 6 12".
bool isFirstLineOfOff(const KindWords& words) {
    const std::string first = lowerCase(words[0]);
    const std::size_t end = first.find("off");
    if (end == std::string::npos || end > 6 ||
        first.substr(0, end).find_first_not_of("stcn4") != std::string::npos) {
        return false;
    }
    const std::string rest = first.substr(end + 3);
    const std::string next = rest.empty() && words.size() > 1 ? lowerCase(words[1]) : rest;
    return next.empty() || next == "binary" || (next[0] >= '0' && next[0] <= '9');
}

bool namesAxes(const KindWords& words) {
    std::string found;
    for (const std::string_view word : words)
        found += " " + lowerCase(word.substr(0, word.find_first_of("[("))) + " ";
    return holds(found, " x ") && holds(found, " y ") && holds(found, " z ");
}

// Three numbers on the first line that is no comment, after a count and the names of columns. Whole numbers
// may also be what OFF without its first word begins with.
bool isTextOfPoints(const std::vector<std::string_view>& lines) {
    bool countMayFollow = true;
    bool namesMayFollow = true;
    for (const std::string_view line : lines) {
        std::string separated(line);
        std::replace_if(
            separated.begin(), separated.end(), [](char c) { return c == ',' || c == ';' || c == '"'; }, ' ');
        const KindWords words = wordsOf(separated);
        if (words.empty() || isOneOf(words[0].substr(0, 1), {"#", "%", "!"}) ||
            words[0].substr(0, 2) == "//") {
            continue;
        }
        std::int64_t count = 0;
        if (std::exchange(countMayFollow, false) && words.size() == 1 && parseInteger(words[0], count))
            continue;
        if (std::exchange(namesMayFollow, false) && namesAxes(words)) continue;
        return beginsWithAPoint(words) &&
               std::any_of(words.begin(), words.begin() + 3,
                           [&](std::string_view word) { return !parseInteger(word, count); });
    }
    return false;
}

bool hasFields(const std::vector<KindWords>& lines) {
    return std::any_of(lines.begin(), lines.end(), [](const KindWords& words) {
        return isOneOf(lowerCase(words[0]), {"fields", "columns"});
    });
}

bool hasVertices(const std::vector<KindWords>& lines) {
    return std::any_of(lines.begin(), lines.end(),
                       [](const KindWords& words) { return words[0] == "v" && beginsWithAPoint(words, 1); });
}

std::string_view endingOfText(const std::string& text) {
    const std::vector<std::string_view> raw = linesOf(text);
    std::vector<KindWords> lines;
    for (const std::string_view line : raw) {
        KindWords words = wordsOf(withoutComment(line));
        if (!words.empty()) lines.push_back(std::move(words));
    }
    if (lines.empty()) return {};
    const std::string first = lowerCase(lines[0][0]);
    if (first == "ply" && lines[0].size() == 1) return ".ply";
    if (isOneOf(first, {"version", "fields", "columns"}) && hasFields(lines)) return ".pcd";
    if (isFirstLineOfOff(lines[0])) return ".off";
    const std::string lower = lowerCase(text);
    if (first.rfind("solid", 0) == 0 && (holds(lower, "facet") || holds(lower, "endsolid"))) return ".stl";
    if (first[0] == '{' && holds(text, "\"asset\"")) return ".gltf";
    const bool objWord =
        isOneOf(first, {"v", "vn", "vt", "vp", "f", "l", "p", "o", "g", "s", "mtllib", "usemtl"});
    if (objWord && hasVertices(lines)) return ".obj";
    return isTextOfPoints(raw) ? ".xyz" : "";
}

bool hasSizeOfStl(std::string_view head, std::uint64_t size) {
    if (head.size() < kStlHeaderBytes) return false;
    const std::uint64_t count =
        loadAs<std::uint32_t>(head.data() + kStlHeaderBytes - 4, !machineIsLittleEndian());
    return count > 0 && size == kStlHeaderBytes + kStlTriangleBytes * count;
}

}  // namespace

std::string_view endingOfContent(std::string_view head, std::optional<std::uint64_t> size) {
    const std::string_view magic = head.substr(0, 4);
    if (magic == "LASF") return ".las";
    if (magic == "glTF") return ".glb";
    if (magic == "PK\x03\x04") return holds(head, "3D/3dmodel.model") ? ".3mf" : "";
    const std::string_view ending = endingOfText(textOf(head));
    if (!ending.empty()) return ending;
    return size && hasSizeOfStl(head, *size) ? ".stl" : "";
}

bool hasTextForBinary(std::string_view head) {
    constexpr std::size_t kLeastText = 12;
    constexpr std::size_t kMostText = 1024;
    constexpr std::string_view kEndOfPly = "end_header";
    const std::string lower = lowerCase(head);
    std::size_t at = std::min(lower.find("\ndata binary"), lower.find("\rdata binary"));
    if (const std::size_t format = lower.find("format binary"); format < at) {
        const std::size_t end = lower.find(kEndOfPly, format);
        at = end == std::string::npos ? end : end + kEndOfPly.size() - 1;
    }
    if (at == std::string::npos) return false;
    const std::size_t lineEnd = lower.find_first_of("\r\n", at + 1);
    if (lineEnd == std::string::npos) return false;
    const std::string_view body = std::string_view(lower).substr(lineEnd).substr(0, kMostText);
    const auto isOfText = [](char c) { return (c >= ' ' && c <= '~') || (c >= '\t' && c <= '\r'); };
    return body.size() >= kLeastText && std::all_of(body.begin(), body.end(), isOfText) &&
           body.find_first_of("0123456789") != std::string_view::npos;
}

std::string_view kindName(std::string_view ending) {
    for (const auto& [known, name] : kKindNames) {
        if (known == ending) return name;
    }
    return {};
}

namespace {

struct Conversion {
    std::initializer_list<std::string_view> endings;
    const char* advice;
};

}  // namespace

std::string conversionAdvice(std::string_view ending) {
    // Also in docs/file-formats.md.
    const std::array<Conversion, 6> conversions = {{
        {{".laz"}, "LAZ is unpacked by 'laszip -i IN.laz -o OUT.las' or 'pdal translate IN.laz OUT.las'"},
        {{".e57", ".ptx", ".fls", ".rcp", ".rcs", ".zfs"},
         "scans of this format are converted by CloudCompare or the scanner's program, to PLY or LAS"},
        {{".dae", ".fbx", ".3ds", ".blend", ".wrl", ".x3d", ".usd", ".usdz", ".amf", ".dxf", ".lwo", ".ase"},
         "models of this format are converted by Blender, or 'assimp export IN OUT.ply'"},
        {{".step", ".stp", ".iges", ".igs", ".brep", ".fcstd", ".sldprt", ".ipt", ".catpart"},
         "solids of CAD programs are exported as STL by them, or by FreeCAD"},
        {{".vtk", ".vtp", ".vtu", ".msh", ".mesh", ".gts", ".xdmf"},
         "meshes of this format are converted by ParaView, or 'meshio convert IN OUT.ply'"},
        {{".zip", ".tar", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst"}, "unpack it first"},
    }};
    for (const Conversion& conversion : conversions) {
        for (const std::string_view known : conversion.endings) {
            if (ending == known) return conversion.advice;
        }
    }
    return {};
}

}  // namespace shapedb::io
