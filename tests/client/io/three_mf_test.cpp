// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

class ThreeMf : public FileTest {
  protected:
    static std::string object(const std::string& id, const std::string& content,
                              const std::string& more = "") {
        return "<object id=\"" + id + "\" " + more + ">" + content + "</object>";
    }
    static std::string model(const std::string& objects, const std::string& build) {
        return "<?xml version=\"1.0\"?>\n<model xmlns=\"core\" xmlns:p=\"production\"><resources>" + objects +
               "</resources><build>" + build + "</build></model>";
    }
    Scan good(const std::string& model) const {
        return readGood("a.3mf", zipArchive({{"3D/3dmodel.model", model}}));
    }
    void bad(const std::string& model, const std::vector<std::string>& parts) const {
        expectError("a.3mf", zipArchive({{"3D/3dmodel.model", model}}), kMalformed, parts);
    }
};

const std::string kMesh =
    "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>\n"
    "<vertex x=\"0\" y=\"2\" z=\"0\"/></vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\" pid=\"4\"/>"
    "</triangles></mesh>";

TEST_F(ThreeMf, PlacesItemsAndComponents) {
    const std::string components =
        "<components><component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 5\"/>"
        "<component objectid=\"1\"/></components>";
    const Scan scan = good(model(object("1", kMesh) + object("2", components),
                                 "<item objectid=\"2\" transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/>"));
    EXPECT_EQ(scan.points,
              (PointCloud{{10, 0, 5}, {10, 1, 5}, {8, 0, 5}, {10, 0, 0}, {10, 1, 0}, {8, 0, 0}}));
    EXPECT_EQ(scan.trianglesInFile, 2U);
    EXPECT_EQ(scan.format, "3MF");
}

TEST_F(ThreeMf, ReadsPartsOfTheirOwnAndRelationships) {
    const std::string root =
        model(object("5",
                     "<components><component p:path=\"/3D/Objects/o.model\" objectid=\"1\"/>"
                     "</components>"),
              "<item objectid=\"5\"/>");
    const std::string rels =
        "<Relationships><Relationship Target=\"/Thumb.png\" Type=\"http://x/thumbnail\"/>"
        "<Relationship Target=\"/Other/m.model\" Type=\"http://x/3dmodel\"/></Relationships>";
    const Scan scan = readGood("a.3mf", zipArchive({{"_rels/.rels", rels},
                                                    {"3D/Objects/o.model", model(object("1", kMesh), "")},
                                                    {"Other/m.model", root}}));
    EXPECT_EQ(scan.points.size(), 3U);
}

TEST_F(ThreeMf, SupportsAndSlicesAreNoParts) {
    const std::string slices =
        "<s:slicestack><s:slice><s:vertices><s:vertex x=\"1\" y=\"1\"/></s:vertices></s:slice>"
        "</s:slicestack>";
    EXPECT_EQ(good(model(slices + object("1", kMesh) + object("2", kMesh, "type=\"support\""),
                         "<item objectid=\"2\"/><item objectid=\"1\"/>"))
                  .points.size(),
              3U);
    // Without a build all objects are one.
    EXPECT_EQ(good(model(object("1", kMesh) + object("2", kMesh), "")).points.size(), 6U);
}

TEST_F(ThreeMf, DefectsNamePartAndLine) {
    const std::string item = "<item objectid=\"1\"/>";
    std::string mesh = kMesh;
    bad(model(object("1", mesh.replace(mesh.find("v3=\"2\""), 6, "v3=\"3\"")), item),
        {"'3D/3dmodel.model' line 3", "v3", "'3'", "3 vertices"});
    mesh = kMesh;
    bad(model(object("1", mesh.replace(mesh.find("x=\"1\""), 5, "x=\"1,5\"")), item),
        {"line 2", "number x", "with a point"});
    bad(model(object("1", kMesh) + object("1", kMesh), item), {"object 1 is there twice"});
    bad(model(object("1", kMesh), "<item objectid=\"2\"/>"), {"object 2", "does not exist"});
    bad(model(object("1", kMesh), "<item objectid=\"1\" transform=\"1 2 3\"/>"), {"twelve numbers"});
    bad(model("", ""), {"no mesh"});
    bad("<model><resources>", {"XML is damaged"});
    bad("<!DOCTYPE m [<!ENTITY a \"b\">]><model/>", {"document type"});
    bad(model(object("1", "<components><component objectid=\"1\"/></components>"), item),
        {"component of itself"});
    expectError("b.3mf", zipArchive({{"a.txt", "b"}}), kMalformed, {"no 3D model"});
    expectError("c.3mf", "<model/>", kMalformed, {"not a ZIP archive"});
    mesh = kMesh;
    expectError("d.3mf",
                zipArchive({{"3D/3dmodel.model",
                             model(object("1", mesh.replace(mesh.find("x=\"1\""), 5, "x=\"nan\"")), item)}}),
                ErrorCode::kNonFiniteCoordinate, {"object 1", "vertex 1"});
    std::string damaged = zipArchive({{"3D/3dmodel.model", model(object("1", kMesh), item)}});
    damaged[60] = static_cast<char>(damaged[60] ^ 0x10);
    EXPECT_FALSE(readVertices("e.3mf", damaged));
}

TEST_F(ThreeMf, BombsAndEndlessCopiesAreRefused) {
    bad(model(object("1", kMesh) + std::string(std::size_t{66} << 20, ' '), "<item objectid=\"1\"/>"),
        {"200 times"});
    // Each object has the one before twice: two to the power of 40 of nothing.
    std::string objects = object("1", "");
    for (int i = 2; i <= 40; ++i) {
        const std::string component = "<component objectid=\"" + std::to_string(i - 1) + "\"/>";
        objects += object(std::to_string(i), "<components>" + component + component + "</components>");
    }
    bad(model(objects, "<item objectid=\"40\"/>"), {"too many copies"});
}

}  // namespace
}  // namespace shapedb
