// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <limits>
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Ply = FileTest;
using PlyHeader = FileTest;

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";

std::string ascii(const std::string& elements, const std::string& body) {
    return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + body;
}

std::string binary(const std::string& elements, const std::string& body) {
    return "ply\nformat binary_little_endian 1.0\n" + elements + "end_header\n" + body;
}

// Every scalar type, as a coordinate and as a property before it, in both byte orders.
class PlyScalars : public FileTest {
  protected:
    template <typename T>
    void check(const std::string& type) const {
        constexpr T kLeast = std::numeric_limits<T>::lowest();
        constexpr T kMost = std::numeric_limits<T>::max();
        for (const bool bigEndian : {false, true}) {
            Bytes bytes(bigEndian);
            bytes.text(std::string("ply\nformat binary_") + (bigEndian ? "big" : "little") +
                       "_endian 1.0\nelement vertex 2\nproperty " + type + " before\nproperty " + type +
                       " x\nproperty float y\nproperty " + type + " z\nend_header\n");
            bytes.add(T(9)).add(T(100)).add(-2.5F).add(T(7));
            bytes.add(T(9)).add(kMost).add(1e30F).add(kLeast);
            const Scan scan = readGood("scalar.ply", bytes.str());
            ASSERT_EQ(scan.points.size(), 2U);
            EXPECT_EQ(scan.points[0], (Point3{100, -2.5, 7})) << type << bigEndian;
            const Point3 extreme = {static_cast<double>(kMost), static_cast<double>(1e30F),
                                    static_cast<double>(kLeast)};
            EXPECT_EQ(scan.points[1], extreme) << type << bigEndian;
        }
    }
};

TEST_F(PlyScalars, ReadsEveryTypeUnderBothNamesInBothByteOrders) {
    for (const char* name : {"char", "int8"}) check<std::int8_t>(name);
    for (const char* name : {"uchar", "uint8"}) check<std::uint8_t>(name);
    for (const char* name : {"short", "int16"}) check<std::int16_t>(name);
    for (const char* name : {"ushort", "uint16"}) check<std::uint16_t>(name);
    for (const char* name : {"int", "int32"}) check<std::int32_t>(name);
    for (const char* name : {"uint", "uint32"}) check<std::uint32_t>(name);
    for (const char* name : {"float", "float32"}) check<float>(name);
    for (const char* name : {"double", "float64"}) check<double>(name);
}

TEST_F(Ply, StripsAlternateAndRestart) {
    const Scan scan = readGood(
        "strip.ply",
        ascii("element vertex 6\n" + kXyz + "element tristrips 1\nproperty list int int vertex_indices\n",
              "0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 0 0\n5 1 0\n10 0 1 2 3 -1 3 4 4 5 -1\n"));
    EXPECT_EQ(scan.verticesInFile, 6U);
    // 012 and 213; the second strip gives 344 and 445, which have no area.
    EXPECT_EQ(scan.trianglesInFile, 2U);
}

TEST_F(Ply, PolygonsBecomeFans) {
    const Scan scan =
        readGood("polygon.ply",
                 ascii("element vertex 5\n" + kXyz +
                           "element face 4\nproperty uchar red\nproperty list uint8 uint32 vertex_index\n"
                           "property list uchar float texcoord\n",
                       "0 0 0\n2 0 0\n2 2 0\n1 3 0\n0 2 0\n9 5 0 1 2 3 4 2 0.5 0.5\n9 2 0 1 0\n9 0 0\n"
                       "9 3 0 1 2 0\n"));
    EXPECT_EQ(scan.trianglesInFile, 4U);
}

TEST_F(Ply, ToleratesBlankLinesPaddingAndAMissingLineEnd) {
    EXPECT_EQ(readGood("a.ply", ascii("element vertex 2\n" + kXyz, "\n1 2 3\n\n \t\n4 5 6")).points.size(),
              2U);
    EXPECT_EQ(readGood("b.ply", ascii("element vertex 1\n" + kXyz, "1 2 3\n\n  \n")).points.size(), 1U);
    const std::string body = Bytes().add(1.0F).add(2.0F).add(3.0F).str();
    EXPECT_EQ(readGood("c.ply", binary("element vertex 1\n" + kXyz, body + std::string("\0\n\r\n", 4)))
                  .points.size(),
              1U);
}

TEST_F(Ply, FacesCountUnderAnyName) {
    const std::string vertices = "element vertex 4\n" + kXyz;
    const std::string body = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    for (const std::string list :
         {"vertex_indices", "vertex_index", "vertices", "Vertex_Indices", "indices"}) {
        for (const std::string element : {"face", "Face", "faces", "polygon"}) {
            const Scan scan =
                readGood("a.ply", ascii(vertices + "element " + element +
                                            " 1\nproperty list uchar float uv\nproperty list uchar int " +
                                            list + "\nproperty uchar red\n",
                                        body + "2 0.5 0.5 4 0 1 2 3 255\n"));
            EXPECT_EQ(scan.trianglesInFile, 2U) << element << " " << list;
        }
    }
    // A known name comes before another one; elements that are no faces are passed over.
    EXPECT_EQ(
        readGood("b.ply", ascii(vertices + "element edge 1\nproperty int vertex1\nproperty list uchar int a\n"
                                           "element face 1\nproperty list uchar int other\n"
                                           "property list uint16 int16 vertex_index\n"
                                           "element camera 1\nproperty float view\n",
                                body + "1 1 2\n2 7 8 3 0 1 2\n0.5\n"))
            .trianglesInFile,
        1U);
    EXPECT_EQ(readGood("c.ply", ascii(vertices + "element face 0\n", body)).trianglesInFile, 0U);
}

TEST_F(Ply, ReadsTheHeadersOfOtherPrograms) {
    EXPECT_EQ(readGood("a.ply",
                       "ply\nformat ascii 1.0\nCreated by Blender3D 247, source file:\nelement vertex 1\n" +
                           kXyz + "property bool visible\nend_header\n1 2 3 1\n")
                  .points.size(),
              1U);
}

TEST_F(Ply, FacesAreNeverPassedOverInSilence) {
    const std::string start = "element vertex 1\n" + kXyz + "element face 1\n";
    const std::string advice = "element face needs a list vertex_indices";
    expectError("a.ply",
                ascii(start + "property list uchar int a\nproperty list uchar int b\n", "1 2 3\n0 0\n"),
                kMalformed, {advice, "several lists"});
    expectError("b.ply", ascii(start + "property list uchar float uv\n", "1 2 3\n0\n"), kMalformed, {advice});
    expectError("c.ply", ascii(start + "property int a\nproperty int b\n", "1 2 3\n0 0\n"), kMalformed,
                {advice});
    expectError("d.ply",
                binary(start + "property int a\nproperty int b\n",
                       Bytes().add(1.0F).add(2.0F).add(3.0F).add(std::uint64_t{0}).str()),
                kMalformed, {advice});
}

TEST_F(Ply, ListsOfAbsurdLengthAreRefused) {
    const std::string start = "element vertex 1\n" + kXyz + "element a 1\nproperty list ";
    for (const std::string type : {"int64", "uint64"}) {
        Bytes body;
        body.add(1.0F).add(2.0F).add(3.0F).add(~std::uint64_t{0} >> (type == "int64" ? 1 : 0)).add(1.0);
        expectError("a.ply", binary(start + type + " double b\n", body.str()), kMalformed,
                    {"ends inside a 0 of 1"});
        body.add(1.0);
        expectError("b.ply", binary(start + type + " int64 vertex_indices\n", body.str()), kMalformed,
                    {"a 0 of 1 names vertex"});
    }
}

TEST_F(Ply, ElementsWithoutPropertiesHaveNoBody) {
    EXPECT_EQ(readGood("a.ply", ascii("element nothing 1000000000000\nelement vertex 1\n" + kXyz, "1 2 3\n"))
                  .points.size(),
              1U);
}

TEST_F(Ply, FileWithoutVerticesIsAnEmptyScan) {
    EXPECT_TRUE(readGood("a.ply", ascii("element vertex 0\n" + kXyz, "")).points.empty());
    EXPECT_TRUE(readGood("b.ply", binary("element vertex 0\n" + kXyz, "")).points.empty());
}

TEST_F(Ply, AcceptsValuesBeyondSinglePrecision) {
    const Scan scan =
        readGood("a.ply", ascii("element vertex 1\nproperty double x\nproperty double y\nproperty double z\n",
                                "1e300 -1e300 1e-300\n"));
    ASSERT_EQ(scan.points.size(), 1U);
    EXPECT_EQ(scan.points[0], (Point3{1e300, -1e300, 1e-300}));
}

TEST_F(PlyHeader, EveryDefectNamesTheLine) {
    const auto malformed = ErrorCode::kMalformedFile;
    expectError("empty.ply", "", malformed, {"the file is empty"});
    expectError("other.ply", "solid\n", malformed, {"line 1", "'ply'"});
    expectError("a.ply", "ply\nformat ascii 1.0\n", malformed, {"line 2", "end_header"});
    expectError("b.ply", "ply\nformat text 1.0\nend_header\n", malformed, {"line 2", "'text'", "ascii"});
    expectError("c.ply", "ply\nend_header\n", malformed, {"line 2", "'format'"});
    expectError("d.ply", "ply\nformat ascii 1.0\nelement vertex many\n", malformed, {"line 3", "'many'"});
    expectError("e.ply", "ply\nformat ascii 1.0\nelement vertex -5\n", malformed, {"line 3", "'-5'"});
    expectError("f.ply", "ply\nformat ascii 1.0\nproperty float x\n", malformed, {"line 3", "before any"});
    expectError("g.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", malformed,
                {"line 4", "'half'"});
    expectError("h.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n", malformed,
                {"line 4", "'float'", "integer"});
    expectError("i.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float\n", malformed,
                {"line 4", "name"});
    expectError("j.ply", "ply\nformat ascii 1.0\nvertex 1\n", malformed, {"line 3", "'vertex'"});
    expectError("k.ply", ascii("element face 0\n", ""), malformed, {"no element vertex"});
    expectError("l.ply", ascii("element vertex 1\nproperty float x\nproperty float y\n", "1 2\n"), malformed,
                {"'z'"});
    expectError("m.ply", ascii("element vertex 1\n" + kXyz + "element vertex 1\n" + kXyz, "1 2 3\n4 5 6\n"),
                malformed, {"twice"});
    expectError("n.ply", ascii("element vertex 1\n" + kXyz + "property float x\n", "1 2 3 4\n"), malformed,
                {"'x'"});
    expectError(
        "o.ply",
        ascii("element vertex 1\n" + kXyz + "element face 1\nproperty list int float vertex_indices\n",
              "1 2 3\n0\n"),
        malformed, {"integers"});
}

TEST_F(Ply, TextDefectsNameTheLineAndWhatWasExpected) {
    const auto malformed = ErrorCode::kMalformedFile;
    const std::string two = "element vertex 2\n" + kXyz;
    expectError("a.ply", ascii(two, "1 2 3\n1 2\n"), malformed,
                {"after line 9", "vertex 1 of 2", "number z"});
    expectError("b.ply", ascii(two, "1 2 3\n1 two 3\n"), malformed, {"line 9", "number y", "'two'"});
    expectError("c.ply", ascii(two, "1 2 3 4\n1 2 3\n"), malformed, {"line 8", "line end", "'4'"});
    expectError("d.ply", ascii(two, "1 2 3\n"), malformed, {"ends after line 8", "vertex 1 of 2"});
    expectError("e.ply", ascii(two, "1 2 3\n1 2 3\n1 2 3\n"), malformed, {"after the last element"});
    const std::string face = two + "element face 1\nproperty list uchar int vertex_indices\n";
    expectError("f.ply", ascii(face, "1 2 3\n1 2 3\n3 0 1 2\n"), malformed,
                {"line 12", "vertex 2", "2 vertices"});
    expectError("g.ply", ascii(face, "1 2 3\n1 2 3\n3 0 1 -1\n"), malformed, {"line 12", "vertex -1"});
    expectError("h.ply", ascii(face, "1 2 3\n1 2 3\n3 0 1\n"), malformed, {"line 12", "entry 2"});
    expectError("i.ply", ascii(face, "1 2 3\n1 2 3\n-3 0 1\n"), malformed, {"line 12", "negative"});
    expectError("j.ply", ascii("element grid 1\nproperty list int int a\n" + two, "-1\n1 2 3\n1 2 3\n"),
                malformed, {"line 10", "negative"});
}

TEST_F(Ply, BinaryDefectsNameTheByteAndElement) {
    const auto malformed = ErrorCode::kMalformedFile;
    const std::string xyz = Bytes().add(1.0F).add(2.0F).add(3.0F).str();
    const std::string header = binary("element vertex 2\n" + kXyz, "");
    expectError("a.ply", header + xyz + xyz.substr(1), malformed,
                {"byte " + std::to_string(header.size()), "announces 2 vertex", "room for 1"});
    expectError("b.ply", header + xyz + xyz + xyz, malformed,
                {"byte " + std::to_string(header.size() + 26), "after the last element"});
    const std::string lists = binary("element vertex 2\nproperty list uchar int a\n" + kXyz, "");
    expectError("c.ply", lists + std::string(1, '\0') + xyz + std::string(1, '\2'), malformed,
                {"byte " + std::to_string(lists.size() + 13), "vertex 1 of 2", "a"});
}

TEST_F(Ply, NonFiniteCoordinatesNameTheVertex) {
    const auto nonFinite = ErrorCode::kNonFiniteCoordinate;
    expectError("a.ply", ascii("element vertex 2\n" + kXyz, "1 2 3\n1 nan 3\n"), nonFinite,
                {"line 9", "vertex 1"});
    expectError("b.ply", ascii("element vertex 2\n" + kXyz, "1 2 3\n1 2 -inf\n"), nonFinite, {"vertex 1"});
    expectError("c.ply", ascii("element vertex 1\n" + kXyz, "1e999 2 3\n"), nonFinite, {"vertex 0"});
    const std::string header = binary("element vertex 3\n" + kXyz, "");
    Bytes body;
    for (int i = 0; i < 8; ++i) body.add(1.0F);
    body.add(std::numeric_limits<float>::quiet_NaN());
    expectError("d.ply", header + body.str(), nonFinite,
                {"byte " + std::to_string(header.size() + 24), "vertex 2"});
}

}  // namespace
}  // namespace shapedb
