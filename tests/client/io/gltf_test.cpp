// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Gltf = FileTest;

// A document of one mesh; its buffer has four float positions, then indices as bytes.
struct Document {
    std::string nodes = R"([{"mesh":0}])";
    std::string primitive = R"({"attributes":{"POSITION":0},"indices":1})";
    std::string accessors = R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
                            R"({"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"})";
    std::string views = R"({"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":6})";
    std::string buffer = R"("byteLength":54)";
    std::string more;

    std::string json() const {
        return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
               R"(,"meshes":[{"primitives":[)" + primitive + R"(]}],"accessors":[)" + accessors +
               R"(],"bufferViews":[)" + views + R"(],"buffers":[{)" + buffer + "}]" + more + "}";
    }
};

std::string buffer(const std::string& indices = std::string("\0\1\2\0\2\3", 6)) {
    Bytes bytes;
    for (const float c : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.0F})
        bytes.add(c);
    return bytes.str() + indices;
}

class GltfFile : public FileTest {
  protected:
    Scan good(const Document& document) const { return readGood("a.glb", glb(document.json(), buffer())); }
    void bad(const Document& document, const std::vector<std::string>& parts) const {
        expectError("a.glb", glb(document.json(), buffer()), kMalformed, parts);
    }
};

TEST_F(GltfFile, PutsNodesWhereTheirParentsAre) {
    Document document;
    document.nodes = R"([{"children":[1,2],"translation":[10,0,0],"scale":[2,2,2]},)"
                     R"({"mesh":0,"rotation":[0,0,0.7071067811865476,0.7071067811865476]},)"
                     R"({"mesh":0,"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]}])";
    const Scan scan = good(document);
    ASSERT_EQ(scan.points.size(), 8U);
    EXPECT_EQ(scan.trianglesInFile, 4U);
    const auto near = [](const Point3& a, const Point3& b) { return squaredDistance(a, b) < 1e-24; };
    EXPECT_TRUE(near(scan.points[1], {10, 2, 0}));  // turned by a right angle
    EXPECT_TRUE(near(scan.points[3], {8, 0, 0}));
    EXPECT_TRUE(near(scan.points[4], {10, 0, 10}));
    EXPECT_TRUE(near(scan.points[6], {12, 2, 10}));
}

TEST_F(GltfFile, ReadsModesTypesAndSparseAccessors) {
    struct Case {
        const char* mode;
        std::size_t triangles;
    };
    for (const Case& one : {Case{"0", 0}, Case{"1", 0}, Case{"4", 2}, Case{"5", 1}, Case{"6", 2}}) {
        Document document;
        document.primitive =
            std::string(R"({"attributes":{"POSITION":0},"indices":1,"mode":)") + one.mode + "}";
        EXPECT_EQ(good(document).points.size(), 4U);
        if (one.mode != std::string("5")) {
            EXPECT_EQ(good(document).trianglesInFile, one.triangles) << one.mode;
        }
        document.primitive = std::string(R"({"attributes":{"POSITION":0},"mode":)") + one.mode + "}";
        if (one.mode != std::string("4")) {
            EXPECT_EQ(good(document).trianglesInFile, one.mode[0] > '4' ? 2U : 0U) << one.mode;
        }
    }
    Document quantized;
    quantized.accessors =
        R"({"bufferView":1,"componentType":5121,"normalized":true,"count":2,"type":"VEC3"})";
    quantized.primitive = R"({"attributes":{"POSITION":0},"mode":0})";
    quantized.more = R"(,"extensionsRequired":["KHR_mesh_quantization","KHR_materials_unlit"])";
    EXPECT_EQ(good(quantized).points[1], (Point3{0, 2.0 / 255.0, 3.0 / 255.0}));
    Document sparse;
    sparse.accessors = R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,)"
                       R"("indices":{"bufferView":1,"byteOffset":1,"componentType":5121},)"
                       R"("values":{"bufferView":0,"byteOffset":24}}})";
    sparse.primitive = R"({"attributes":{"POSITION":0},"mode":0})";
    EXPECT_EQ(good(sparse).points, (PointCloud{{0, 0, 0}, {1, 1, 0}, {1, 1, 0}, {0, 1, 0}}));
    sparse.accessors.replace(1, 15, "");  // without a view: zeros
    EXPECT_EQ(good(sparse).points, (PointCloud{{0, 0, 0}, {1, 1, 0}, {0, 0, 0}, {0, 0, 0}}));
}

TEST_F(GltfFile, ReadsDocumentsWithoutScenesOrNodes) {
    const std::string start = R"({"asset":{"version":"2.0"},)";
    std::string json = Document().json();
    json.replace(0, json.find("\"nodes\":[{"), start);
    EXPECT_EQ(readGood("a.glb", glb(json, buffer())).points.size(), 4U);
    json.replace(0, json.find("\"meshes\""), start);
    EXPECT_EQ(readGood("b.glb", glb(json, buffer())).points.size(), 4U);
}

TEST_F(GltfFile, ReadsBuffersInFilesBelowItsFolderOnly) {
    Document document;
    write("set/data/a b.bin", buffer());
    document.buffer = R"("byteLength":54,"uri":"data/a%20b.bin")";
    EXPECT_EQ(readGood("set/a.gltf", document.json()).points.size(), 4U);
    EXPECT_EQ(readGood("set/b.gltf", "\xEF\xBB\xBF" + document.json() + "\r\n").format, "glTF");
    write("secret.bin", buffer());
    for (const std::string& uri : std::vector<std::string>{
             "../secret.bin", "data/../../secret.bin", "/etc/passwd", "%2e%2e/secret.bin",
             "file:///etc/passwd", "http://a/b.bin", "a\\u0000b", "a\\nb", ""}) {
        document.buffer = R"("byteLength":54,"uri":")" + uri + "\"";
        expectError("set/c.gltf", document.json(), kMalformed, {"buffers[0]", "not below the folder"});
    }
    document.buffer = R"("byteLength":54,"uri":"missing.bin")";
    expectError("set/d.gltf", document.json(), ErrorCode::kFileNotReadable, {"buffers[0]", "missing.bin"});
    document.buffer = R"("byteLength":55,"uri":"data/a%20b.bin")";
    expectError("set/e.gltf", document.json(), kMalformed, {"54 bytes of 55"});
    document.buffer = R"("byteLength":54,"uri":"data:;base64,$$$$")";
    expectError("f.gltf", document.json(), kMalformed, {"base64"});
    document.buffer = R"("byteLength":54)";
    expectError("g.gltf", document.json(), kMalformed, {"buffers[0] has no data"});
}

TEST_F(GltfFile, NothingIsReadBeyondItsBounds) {
    const std::string view = R"({"buffer":0,"byteLength":48})";
    for (const std::string& views : std::vector<std::string>{
             R"({"buffer":0,"byteLength":55})", R"({"buffer":0,"byteOffset":10,"byteLength":48})",
             R"({"buffer":0,"byteOffset":18446744073709551615,"byteLength":48})"}) {
        Document document;
        document.views = views + "," + view;
        bad(document, {"bufferViews[0]", "beyond"});
    }
    const std::string indices = R"(,{"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"})";
    for (const std::string& members : std::vector<std::string>{
             R"("count":5)", R"("count":4,"byteOffset":1)", R"("count":18446744073709551615)",
             R"("count":4,"byteOffset":18446744073709551615)"}) {
        Document document;
        document.accessors =
            R"({"bufferView":0,"componentType":5126,"type":"VEC3",)" + members + "}" + indices;
        bad(document, {"accessors[0]", "beyond"});
    }
    Document document;
    document.accessors = R"({"componentType":5126,"count":1000000000000,"type":"VEC3"})" + indices;
    bad(document, {"accessors[0] has no data"});
    document.accessors = R"({"bufferView":9,"componentType":5126,"count":4,"type":"VEC3"})" + indices;
    bad(document, {"bufferViews[9]", "does not exist"});
    document = Document();
    document.views =
        R"({"buffer":0,"byteLength":48,"byteStride":4},{"buffer":0,"byteOffset":48,"byteLength":6})";
    bad(document, {"overlap"});
    document = Document();
    expectError("b.glb", glb(document.json(), buffer(std::string("\0\1\2\0\2\4", 6))), kMalformed,
                {"meshes[0]", "vertex 4", "4 vertices"});
    document.accessors.replace(document.accessors.find("count\":6"), 8, "count\":5");
    bad(document, {"three corners"});
}

TEST_F(GltfFile, DefectsAreNamed) {
    Document document;
    document.nodes = R"([{"mesh":0,"children":[0]}])";
    bad(document, {"nodes[0]", "twice"});
    document.nodes = R"([{"mesh":3}])";
    bad(document, {"nodes[0]", "meshes[3]"});
    document = Document();
    document.more = R"(,"extensionsRequired":["KHR_draco_mesh_compression"])";
    bad(document, {"KHR_draco_mesh_compression"});
    expectError("a.gltf", "{\"asset\":{\"version\":\"1.0\"}}", kMalformed, {"'1.0'", "glTF 2"});
    expectError("b.gltf", "{\"asset\":", kMalformed, {"JSON"});
    expectError("c.gltf", "[]", kMalformed, {"JSON"});
    expectError("d.gltf", "{\"asset\":{\"version\":\"2.0\"}}", kMalformed, {"no mesh"});
    const std::string whole = glb(Document().json(), buffer());
    expectError("e.glb", whole + "x", kMalformed, {"after the announced end"});
    expectError("f.glb", whole.substr(0, whole.size() - 1), kMalformed, {"cut short"});
    std::string old = whole;
    old[4] = '\1';
    expectError("g.glb", old, kMalformed, {"version 1"});
    // Deeply nested text must not exhaust the stack.
    expectError("h.gltf", std::string(100'000, '['), kMalformed, {"JSON"});
}

TEST_F(GltfFile, CopiesAreBounded) {
    // 1,500 nodes with a mesh of 1,000 vertices at one place: a million from 40 kB are enough.
    Document document;
    document.nodes = "[";
    std::string scene;
    for (int i = 0; i < 1500; ++i) {
        document.nodes += std::string(i == 0 ? "" : ",") + R"({"mesh":0})";
        scene += (i == 0 ? "" : ",") + std::to_string(i);
    }
    document.nodes += "]";
    document.accessors = R"({"bufferView":0,"componentType":5121,"count":1000,"type":"VEC3"})";
    document.primitive = R"({"attributes":{"POSITION":0},"mode":0})";
    document.views = R"({"buffer":0,"byteLength":3000})";
    document.buffer = R"("byteLength":3000)";
    std::string json = document.json();
    json.replace(json.find("\"nodes\":[0]"), 11, "\"nodes\":[" + scene + "]");
    EXPECT_EQ(readGood("a.glb", glb(json, std::string(3000, '\1'))).verticesInFile, 1'500'000U);
    ReadOptions options;
    options.maxPoints = 5000;
    const auto scan = readScan(path("a.glb"), options);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kPointLimitExceeded);
}

}  // namespace
}  // namespace shapedb
