// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Stl = FileTest;

std::string facet(const std::string& a, const std::string& b, const std::string& c) {
    return "facet normal 0 0 1\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c +
           "\nendloop\nendfacet\n";
}

std::string binary(std::uint32_t announced, const std::string& triangles, std::string header = "") {
    header.resize(80, '\0');
    return header + Bytes().add(announced).str() + triangles;
}

std::string triangle(float z) {
    Bytes bytes;
    for (const float c : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, z, 1.0F, 0.0F, z, 0.0F, 1.0F, z}) bytes.add(c);
    return bytes.add(std::uint16_t{0xabcd}).str();
}

TEST_F(Stl, MergesEqualCorners) {
    const Scan scan = readGood("a.stl", "solid\n" + facet("0 0 0", "1 0 0", "0 1 0") +
                                            facet("-0 0 0", "0 1 0", "0 0 1") + "endsolid\n");
    EXPECT_EQ(scan.verticesInFile, 4U);
    EXPECT_EQ(scan.trianglesInFile, 2U);
    EXPECT_EQ(scan.format, "STL ASCII");
}

TEST_F(Stl, ReadsSeveralSolidsInAnyCase) {
    const Scan scan = readGood("a.stl", "\n SOLID one two\n" + facet("0 0 0", "1 0 0", "0 1 0") +
                                            "ENDSOLID one two\r\n\r\nsolid\r\n" +
                                            facet("5 0 0", "6 0 0", "5 1 0") + "EndSolid");
    EXPECT_EQ(scan.trianglesInFile, 2U);
}

TEST_F(Stl, ReadsTheSpellingsOfOtherPrograms) {
    const std::string one = facet("0 0 0", "1 0 0", "0 1 0");
    std::string apart = one;
    apart.replace(apart.find("endloop"), 7, "end loop").replace(apart.find("endfacet"), 8, "End  Facet");
    std::string bare = one;
    bare.replace(0, bare.find('\n'), "facet");
    for (const std::string& text :
         {"solid a\n" + apart + "end solid a\n", "solid AssimpScene\n" + one + "endsolidAssimpScene\n",
          " solid\n" + bare + "endsolid", "solid facet\n" + one + "endsolid facet\n",
          "solid\n" + one + "endsolid\nsolid b c\nendsolid b c\n"}) {
        EXPECT_EQ(readGood("a.stl", text).trianglesInFile, 1U) << text;
    }
    expectError("b.stl", "solid\n" + one + "end\n", kMalformed, {"line 9", "'end'"});
}

TEST_F(Stl, ReadsBinaryFilesThatStartWithSolid) {
    EXPECT_EQ(readGood("a.stl", binary(2, triangle(0) + triangle(1), "solid exported by a test")).format,
              "STL binary");
    // The size is wrong, but text has no zero bytes: read as binary, and refused.
    expectError("b.stl", binary(3, triangle(0) + triangle(1), "solid exported"), kMalformed,
                {"byte 80", "3 triangles", "room for 2"});
}

TEST_F(Stl, BinaryDefectsNameTheByte) {
    expectError("empty.stl", "", kMalformed, {"the file is empty"});
    expectError("a.stl", std::string(83, '\0'), kMalformed, {"found 83"});
    expectError("b.stl", binary(4000000000U, triangle(0)), kMalformed, {"4000000000", "room for 1"});
    expectError("c.stl", binary(1, triangle(0) + triangle(1)), kMalformed, {"byte 144", "after the last"});
    expectError("d.stl", binary(2, triangle(0) + triangle(std::numeric_limits<float>::quiet_NaN())),
                ErrorCode::kNonFiniteCoordinate, {"byte 134", "triangle 1"});
    EXPECT_EQ(readGood("e.stl", binary(0, "")).points.size(), 0U);
}

TEST_F(Stl, TextDefectsNameTheLine) {
    expectError("a.stl", "solid\nfacet normal 0 0 1\nvertex 0 0 0\n", kMalformed,
                {"line 3", "'outer'", "'vertex'"});
    expectError("b.stl", "solid\n" + facet("0 0 0", "1 0", "0 1 0"), kMalformed, {"line 5", "three numbers"});
    expectError("c.stl", "solid\n" + facet("0 0 0", "1 0 0", "0 1 0"), kMalformed,
                {"after line 8", "'endsolid'"});
    expectError("d.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n", kMalformed,
                {"line 5", "'vertex'", "'endloop'"});
    expectError("e.stl", "solid\n" + facet("0 0 0", "1 inf 0", "0 1 0"), ErrorCode::kNonFiniteCoordinate,
                {"line 5"});
    expectError("f.stl", "solid\nendsolid\nrubbish\n", kMalformed, {"line 3", "'rubbish'"});
}

}  // namespace
}  // namespace shapedb
