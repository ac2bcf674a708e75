// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/client/io/test_files.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <lzf.h>
#include <stdlib.h>
#include <unistd.h>
#include <zip.h>

namespace shapedb {

namespace fs = std::filesystem;

FileTest::FileTest() {
    std::string pattern = (fs::temp_directory_path() / "shapedb-io-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data()) != nullptr ? pattern : "";
}

FileTest::~FileTest() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

std::string FileTest::write(const std::string& name, const std::string& bytes) const {
    const std::string full = path(name);
    fs::create_directories(fs::path(full).parent_path());
    // Always a new file: on some file systems overwriting one waits for the disk.
    if (fs::is_regular_file(full)) fs::remove(full);
    std::ofstream(full, std::ios::binary) << bytes;
    return full;
}

Result<Scan> FileTest::readVertices(const std::string& name, const std::string& bytes) const {
    ReadOptions options;
    options.meshHandling = MeshHandling::kVertices;
    return readScan(write(name, bytes), options);
}

Scan FileTest::readGood(const std::string& name, const std::string& bytes) const {
    auto scan = readVertices(name, bytes);
    EXPECT_TRUE(scan) << name << ": " << (scan ? "" : scan.error().message);
    return scan ? *scan : Scan{};
}

void FileTest::expectError(const std::string& name, const std::string& bytes, ErrorCode code,
                           const std::vector<std::string>& parts) const {
    const auto scan = readVertices(name, bytes);
    ASSERT_FALSE(scan) << name << " was read, but should be refused";
    EXPECT_STREQ(errorCodeName(scan.error().code), errorCodeName(code)) << scan.error().message;
    EXPECT_NE(scan.error().message.find(path(name)), std::string::npos) << scan.error().message;
    for (const std::string& part : parts) {
        EXPECT_NE(scan.error().message.find(part), std::string::npos)
            << "message '" << scan.error().message << "' lacks '" << part << "'";
    }
}

PointCloud sampleVertices() { return {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0.5, 0.25, -4}, {3, 3, 3.5}}; }

namespace {

constexpr std::array<std::array<std::uint32_t, 3>, 4> kFaces = {
    {{{0, 2, 1}}, {{0, 1, 3}}, {{1, 2, 3}}, {{2, 0, 3}}}};

std::string textVertices(const std::string& lineEnd, const std::string& suffix = "") {
    std::string text;
    for (const Point3& p : sampleVertices()) {
        for (const double c : {p.x, p.y, p.z}) {
            std::string number = std::to_string(c);
            text += number + " ";
        }
        text += suffix + lineEnd;
    }
    return text;
}

std::string plyHeader(const std::string& format, const std::string& scalar, const std::string& lineEnd) {
    std::string text;
    for (const std::string& line :
         {std::string("ply"), "format " + format + " 1.0", std::string("comment made by a test"),
          std::string("obj_info num_cols 512"), std::string("element vertex 5"), "property " + scalar + " x",
          "property " + scalar + " y", "property " + scalar + " z", std::string("element face 4"),
          std::string("property list uchar int vertex_indices"), std::string("end_header")}) {
        text += line + lineEnd;
    }
    return text;
}

std::string asciiPly(const std::string& lineEnd) {
    std::string text = plyHeader("ascii", "float", lineEnd) + textVertices(lineEnd);
    for (const auto& f : kFaces) {
        text +=
            "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + lineEnd;
    }
    return text;
}

template <typename Real>
std::string binaryPly(bool bigEndian, const std::string& scalar) {
    Bytes bytes(bigEndian);
    bytes.text(plyHeader(bigEndian ? "binary_big_endian" : "binary_little_endian", scalar, "\n"));
    for (const Point3& p : sampleVertices()) {
        bytes.add(static_cast<Real>(p.x)).add(static_cast<Real>(p.y)).add(static_cast<Real>(p.z));
    }
    for (const auto& f : kFaces) {
        bytes.add(std::uint8_t{3});
        for (const std::uint32_t v : f) bytes.add(static_cast<std::int32_t>(v));
    }
    return bytes.str();
}

// range_grid before the vertices, a list within them, strips after them.
std::string listPly(bool text) {
    const std::string header = std::string("ply\nformat ") + (text ? "ascii" : "binary_little_endian") +
                               " 1.0\nelement range_grid 3\nproperty list uchar int vertex_indices\n"
                               "element vertex 5\nproperty uchar quality\nproperty double z\n"
                               "property list ushort float weights\nproperty float x\nproperty float y\n"
                               "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    const std::vector<std::int32_t> strip = {0, 1, 2, 3, -1, 1, 2, 4};
    Bytes bytes;
    bytes.text(header);
    if (text) {
        bytes.text("0\n1 4\n0\n");
        for (const Point3& p : sampleVertices()) {
            bytes.text("7 " + std::to_string(p.z) + " 2 0.5 0.25 " + std::to_string(p.x) + " " +
                       std::to_string(p.y) + "\n");
        }
        bytes.text("8");
        for (const std::int32_t v : strip) bytes.text(" " + std::to_string(v));
        return bytes.text("\n").str();
    }
    bytes.add(std::uint8_t{0}).add(std::uint8_t{1}).add(std::int32_t{4}).add(std::uint8_t{0});
    for (const Point3& p : sampleVertices()) {
        bytes.add(std::uint8_t{7}).add(p.z).add(std::uint16_t{2}).add(0.5F).add(0.25F);
        bytes.add(static_cast<float>(p.x)).add(static_cast<float>(p.y));
    }
    bytes.add(static_cast<std::int32_t>(strip.size()));
    for (const std::int32_t v : strip) bytes.add(v);
    return bytes.str();
}

std::string pcdHeader(const std::string& data) {
    return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n"
           "WIDTH 5\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 5\nDATA " +
           data + "\n";
}

std::string binaryPcd() {
    Bytes bytes;
    bytes.text(pcdHeader("binary"));
    for (const Point3& p : sampleVertices()) {
        bytes.add(static_cast<float>(p.x)).add(static_cast<float>(p.y)).add(static_cast<float>(p.z));
        bytes.add(std::uint32_t{0xff00ff});
    }
    return bytes.str();
}

std::string compressedPcd() {
    Bytes columns;
    for (const Point3& p : sampleVertices()) columns.add(static_cast<float>(p.x));
    for (const Point3& p : sampleVertices()) columns.add(static_cast<float>(p.y));
    for (const Point3& p : sampleVertices()) columns.add(static_cast<float>(p.z));
    for (int i = 0; i < 5; ++i) columns.add(std::uint32_t{0});
    return pcdHeader("binary_compressed") + compressedPcdBody(columns.str());
}

std::string off() {
    std::string text = "OFF # a comment\n\n5 4 0\n" + textVertices("\n");
    for (const auto& f : kFaces) {
        text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
                " 0.5 0 1\n";
    }
    return text;
}

std::string obj() {
    std::string text = "# made by a test\nmtllib a.mtl\no thing\n";
    for (const Point3& p : sampleVertices()) {
        text += "v " + std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
    }
    text += "vt 0 0\nvn 0 0 1\ns off\n";
    const std::array<const char*, 4> corner = {"", "/1", "//1", "/1/1"};
    for (std::size_t i = 0; i < kFaces.size(); ++i) {
        text += "f";
        for (const std::uint32_t v : kFaces[i]) text += " " + std::to_string(v + 1) + corner[i];
        text += "\n";
    }
    return text;
}

std::string asciiStl() {
    const PointCloud v = sampleVertices();
    std::string text = "solid thing\n";
    for (const auto& f : kFaces) {
        text += "  facet normal nan nan nan\n    outer loop\n";
        for (const std::uint32_t i : f) {
            text += "      vertex " + std::to_string(v[i].x) + " " + std::to_string(v[i].y) + " " +
                    std::to_string(v[i].z) + "\n";
        }
        text += "    endloop\n  endfacet\n";
    }
    return text + "endsolid thing\n";
}

std::string binaryStl(std::string header) {
    const PointCloud v = sampleVertices();
    header.resize(80, ' ');
    Bytes bytes;
    bytes.text(header).add(static_cast<std::uint32_t>(kFaces.size()));
    for (const auto& f : kFaces) {
        bytes.add(0.0F).add(0.0F).add(1.0F);
        for (const std::uint32_t i : f) {
            bytes.add(static_cast<float>(v[i].x))
                .add(static_cast<float>(v[i].y))
                .add(static_cast<float>(v[i].z));
        }
        bytes.add(std::uint16_t{0});
    }
    return bytes.str();
}

// The JSON text of a document whose buffer has the vertices and then the corners of kFaces.
std::string gltfJson(const std::string& bufferMembers) {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
           R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
           R"("accessors":[{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"},)"
           R"({"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],)"
           R"("bufferViews":[{"buffer":0,"byteLength":60},{"buffer":0,"byteOffset":60,"byteLength":24}],)"
           R"("buffers":[{"byteLength":84)" +
           bufferMembers + "}]}";
}

std::string gltfBuffer() {
    Bytes bytes;
    for (const Point3& p : sampleVertices()) {
        bytes.add(static_cast<float>(p.x)).add(static_cast<float>(p.y)).add(static_cast<float>(p.z));
    }
    for (const auto& f : kFaces) {
        for (const std::uint32_t v : f) bytes.add(static_cast<std::uint16_t>(v));
    }
    return bytes.str();
}

std::string las() {
    Bytes bytes;
    bytes.text("LASF" + std::string(20, '\0'))
        .add(std::uint8_t{1})
        .add(std::uint8_t{2})
        .text(std::string(68, ' '));
    bytes.add(std::uint16_t{227}).add(std::uint32_t{227}).add(std::uint32_t{0});
    bytes.add(std::uint8_t{0}).add(std::uint16_t{20}).add(std::uint32_t{5}).text(std::string(20, '\0'));
    for (int axis = 0; axis < 3; ++axis) bytes.add(0.25);
    bytes.add(0.0).add(1.0).add(-1.0).text(std::string(48, '\0'));
    for (const Point3& p : sampleVertices()) {
        for (const double c : {p.x, p.y - 1.0, p.z + 1.0}) bytes.add(static_cast<std::int32_t>(4.0 * c));
        bytes.text("the rest");
    }
    return bytes.str();
}

std::string threeMf() {
    std::string model =
        R"(<?xml version="1.0"?><model unit="millimeter"><resources><object id="7"><mesh><vertices>)";
    for (const Point3& p : sampleVertices()) {
        model += "<vertex x=\"" + std::to_string(p.x) + "\" y=\"" + std::to_string(p.y) + "\" z=\"" +
                 std::to_string(p.z) + "\"/>";
    }
    model += "</vertices><triangles>";
    for (const auto& f : kFaces) {
        model += "<triangle v1=\"" + std::to_string(f[0]) + "\" v2=\"" + std::to_string(f[1]) + "\" v3=\"" +
                 std::to_string(f[2]) + "\"/>";
    }
    model += R"(</triangles></mesh></object></resources><build><item objectid="7"/></build></model>)";
    return zipArchive({{"3D/3dmodel.model", model}});
}

}  // namespace

std::string compressedPcdBody(const std::string& fieldByField) {
    std::string packed(2 * fieldByField.size() + 64, '\0');
    const unsigned size = lzf_compress(fieldByField.data(), static_cast<unsigned>(fieldByField.size()),
                                       packed.data(), static_cast<unsigned>(packed.size()));
    packed.resize(size);
    Bytes sizes;
    sizes.add(static_cast<std::uint32_t>(size)).add(static_cast<std::uint32_t>(fieldByField.size()));
    return sizes.str() + packed;
}

std::string zipArchive(const std::vector<std::pair<std::string, std::string>>& entries) {
    std::string pattern = (fs::temp_directory_path() / "shapedb-zip-XXXXXX").string();
    ::close(::mkstemp(pattern.data()));
    zip_t* archive = ::zip_open(pattern.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
    EXPECT_NE(archive, nullptr);
    for (const auto& [name, content] : entries) {
        zip_source_t* source = ::zip_source_buffer(archive, content.data(), content.size(), 0);
        EXPECT_GE(::zip_file_add(archive, name.c_str(), source, 0), 0);
    }
    EXPECT_EQ(::zip_close(archive), 0);
    std::ifstream stream(pattern, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    fs::remove(pattern);
    return bytes;
}

std::string glb(const std::string& json, const std::string& binary) {
    const auto padded = [](std::string text, char filler) {
        text.resize((text.size() + 3) / 4 * 4, filler);
        return text;
    };
    const auto chunk = [&](const char* type, const std::string& content) {
        return Bytes()
            .add(static_cast<std::uint32_t>(content.size()))
            .text(std::string(type, 4))
            .text(content)
            .str();
    };
    std::string chunks = chunk("JSON", padded(json, ' '));
    if (!binary.empty()) chunks += chunk("BIN", padded(binary, '\0'));
    const auto length = static_cast<std::uint32_t>(12 + chunks.size());
    return Bytes().text("glTF").add(std::uint32_t{2}).add(length).text(chunks).str();
}

std::string base64(const std::string& bytes) {
    const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t j = i; j < i + 3; ++j) {
            bits = bits * 256 + (j < bytes.size() ? static_cast<unsigned char>(bytes[j]) : 0);
        }
        for (std::size_t j = 0; j < 4; ++j) {
            text += i + j > bytes.size() ? '=' : letters[(bits >> (18 - 6 * j)) & 63U];
        }
    }
    return text;
}

std::string unBase64(const std::string& text) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t bits = 0;
    int held = 0;
    for (const char c : text.substr(0, text.find('='))) {
        bits = bits << 6 | static_cast<std::uint32_t>(letters.find(c));
        held += 6;
        if (held < 8) continue;
        held -= 8;
        bytes += static_cast<char>(bits >> held & 255U);
    }
    return bytes;
}

std::vector<SampleFile> sampleFiles() {
    return {
        {"ascii.ply", asciiPly("\n"), 5, 4},
        {"crlf.ply", asciiPly("\r\n"), 5, 4},
        {"little.ply", binaryPly<float>(false, "float"), 5, 4},
        {"big.ply", binaryPly<float>(true, "float32"), 5, 4},
        {"double.ply", binaryPly<double>(false, "double"), 5, 4},
        {"bigdouble.PLY", binaryPly<double>(true, "float64"), 5, 4},
        {"lists.ply", listPly(true), 5, 3},
        {"lists-binary.ply", listPly(false), 5, 3},
        {"ascii.pcd", pcdHeader("ascii") + textVertices("\n", "255"), 5, 0},
        {"binary.pcd", binaryPcd(), 5, 0},
        {"compressed.Pcd", compressedPcd(), 5, 0},
        {"plain.off", off(), 5, 4},
        {"plain.obj", obj(), 5, 4},
        {"ascii.stl", asciiStl(), 4, 4},
        {"binary.stl", binaryStl("made by a test"), 4, 4},
        {"solid.stl", binaryStl("solid but binary"), 4, 4},
        {"points.las", las(), 5, 0},
        {"scene.gltf",
         gltfJson(",\"uri\":\"data:application/octet-stream;base64," + base64(gltfBuffer()) + "\""), 5, 4},
        {"scene.glb", glb(gltfJson(""), gltfBuffer()), 5, 4},
        {"part.3mf", threeMf(), 5, 4},
        {"plain.xyz", "# points\n" + textVertices("\n"), 5, 0},
        {"crlf.txt", textVertices("\r\n", "255 0 0"), 5, 0},
        {"counted.pts", "5\n" + textVertices("\n", "-17 255 0 0"), 5, 0},
    };
}

}  // namespace shapedb
