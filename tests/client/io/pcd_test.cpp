// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Pcd = FileTest;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::string header(const std::string& fields, const std::string& size, const std::string& type,
                   const std::string& count, const std::string& width, const std::string& height,
                   const std::string& data) {
    return "VERSION 0.7\nFIELDS " + fields + "\nSIZE " + size + "\nTYPE " + type + "\nCOUNT " + count +
           "\nWIDTH " + width + "\nHEIGHT " + height + "\nVIEWPOINT 0 0 0 1 0 0 0\nDATA " + data + "\n";
}

std::string xyz(const std::string& width, const std::string& height, const std::string& data) {
    return header("x y z", "4 4 4", "F F F", "1 1 1", width, height, data);
}

TEST_F(Pcd, SkipsAndCountsPointsThatAreNotANumber) {
    const Scan text = readGood("a.pcd", xyz("2", "2", "ascii") + "1 2 3\nnan nan nan\n4 5 6\n1 nan 2\n");
    EXPECT_EQ(text.points, (PointCloud{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(text.skippedNonFinite, 2U);
    EXPECT_EQ(text.verticesInFile, 4U);

    Bytes rows;
    rows.add(1.0F).add(2.0F).add(3.0F).add(kNan).add(kNan).add(kNan);
    const Scan binary = readGood("b.pcd", xyz("2", "1", "binary") + rows.str());
    EXPECT_EQ(binary.points, (PointCloud{{1, 2, 3}}));
    EXPECT_EQ(binary.skippedNonFinite, 1U);

    Bytes columns;
    columns.add(1.0F).add(kNan).add(2.0F).add(kNan).add(3.0F).add(kNan);
    const Scan packed =
        readGood("c.pcd", xyz("2", "1", "binary_compressed") + compressedPcdBody(columns.str()));
    EXPECT_EQ(packed.points, (PointCloud{{1, 2, 3}}));
    EXPECT_EQ(packed.skippedNonFinite, 1U);
}

TEST_F(Pcd, ReadsArrayFieldsPaddingAndMixedTypes) {
    const std::string fields = "_ fpfh z label x y";
    const std::string sizes = "1 4 8 2 4 1";
    const std::string types = "U F F U I I";
    const std::string counts = "3 5 1 1 1 1";
    const Scan text = readGood("a.pcd", header(fields, sizes, types, counts, "1", "1", "ascii") +
                                            "0 0 0 1 2 3 4 5 0.5 9 -70000 -7\n");
    EXPECT_EQ(text.points, (PointCloud{{-70000, -7, 0.5}}));

    Bytes row;
    row.text("pad");
    for (int i = 0; i < 5; ++i) row.add(1.0F);
    row.add(0.5).add(std::uint16_t{9}).add(std::int32_t{-70000}).add(std::int8_t{-7});
    EXPECT_EQ(readGood("b.pcd", header(fields, sizes, types, counts, "1", "1", "binary") + row.str()).points,
              text.points);
    // With a single point, column order equals row order; compressed data may include the padding or not.
    const std::string packed = header(fields, sizes, types, counts, "1", "1", "binary_compressed");
    EXPECT_EQ(readGood("c.pcd", packed + compressedPcdBody(row.str())).points, text.points);
    EXPECT_EQ(readGood("d.pcd", packed + compressedPcdBody(row.str().substr(3))).points, text.points);
}

TEST_F(Pcd, FieldsOfCountZeroHaveNoBytes) {
    const std::string start =
        "FIELDS _ x y _ z rgb none\nSIZE 1 4 4 1 4 4 8\nTYPE U F F U F F F\nCOUNT 4 1 1 0 1 1 0\n";
    const PointCloud expected = {{1, 2, 3}};
    EXPECT_EQ(readGood("a.pcd", start + "POINTS 1\nDATA ascii\n0 0 0 0 1 2 3 nan\n").points, expected);
    Bytes row;
    row.text("pads").add(1.0F).add(2.0F).add(3.0F).add(9.0F);
    EXPECT_EQ(readGood("b.pcd", start + "POINTS 1\nDATA binary\n" + row.str()).points, expected);
    const std::string packed = start + "POINTS 1\nDATA binary_compressed\n";
    EXPECT_EQ(readGood("c.pcd", packed + compressedPcdBody(row.str())).points, expected);
    EXPECT_EQ(readGood("d.pcd", packed + compressedPcdBody(row.str().substr(4))).points, expected);
    expectError("e.pcd", "FIELDS x y z\nCOUNT 1 1 0\nPOINTS 1\nDATA ascii\n1 2\n", kMalformed,
                {"'z'", "0 x"});
}

TEST_F(Pcd, ReadsEveryVersionAndFieldOrder) {
    const PointCloud expected = {{1, 2, 3}};
    for (const std::string version :
         {"", "VERSION .5\n", "VERSION .7\n", "VERSION 0.7\n", "version 0.7\n", "# .PCD v.7\n"}) {
        EXPECT_EQ(
            readGood("a.pcd",
                     version +
                         "FIELDS rgb z normal_x y x\nSIZE 4 4 4 4 4\nTYPE U F F F F\nWIDTH 1\nHEIGHT 1\n"
                         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n4286611584 3 nan 2 1\n")
                .points,
            expected)
            << version;
    }
    // As PCL: without rows there is one.
    for (const std::string size :
         {"WIDTH 1\nHEIGHT 0\n", "WIDTH 0\nHEIGHT 0\nPOINTS 1\n", "POINTS 1\n", "WIDTH 1\n"}) {
        EXPECT_EQ(readGood("b.pcd", "FIELDS x y z\n" + size + "DATA ascii\n1 2 3\n").points, expected)
            << size;
    }
}

TEST_F(Pcd, ReadsOlderHeadersWithoutSizeAndCount) {
    EXPECT_EQ(
        readGood("a.pcd", "# .PCD v.5\r\nVERSION .5\r\nCOLUMNS x y z\r\nPOINTS 1\r\nDATA ascii\r\n1 2 3\r\n")
            .points,
        (PointCloud{{1, 2, 3}}));
}

TEST_F(Pcd, EmptyCloudsAreEmptyScans) {
    EXPECT_TRUE(readGood("a.pcd", xyz("0", "1", "ascii")).points.empty());
    EXPECT_TRUE(readGood("b.pcd", xyz("0", "0", "binary")).points.empty());
    EXPECT_TRUE(readGood("c.pcd", xyz("0", "1", "binary_compressed") + std::string(8, '\0')).points.empty());
}

TEST_F(Pcd, HeaderDefectsNameTheLine) {
    expectError("empty.pcd", "", kMalformed, {"the file is empty"});
    expectError("a.pcd", "PCD\n", kMalformed, {"line 1", "PCD keyword", "'PCD'"});
    expectError("b.pcd", "FIELDS x y\n", kMalformed, {"line 1", "'z'"});
    expectError("c.pcd", "FIELDS x y z x\n", kMalformed, {"line 1", "'x'", "twice"});
    expectError("d.pcd", "FIELDS x y z\nSIZE 4 4\n", kMalformed, {"line 2", "SIZE", "'z'"});
    expectError("e.pcd", "FIELDS x y z\nSIZE 4 4 4 4\n", kMalformed, {"line 2", "SIZE", "3 fields"});
    expectError("f.pcd", "FIELDS x y z\nSIZE 4 4 9\n", kMalformed, {"line 2", "'9'"});
    expectError("g.pcd", "FIELDS x y z\nTYPE F F D\n", kMalformed, {"line 2", "'D'"});
    expectError("h.pcd", "FIELDS x y z\nWIDTH wide\n", kMalformed, {"line 2", "WIDTH", "'wide'"});
    expectError("i.pcd", "FIELDS x y z\nPOINTS 1\nDATA zip\n", kMalformed, {"line 3", "'zip'"});
    expectError("j.pcd", "FIELDS x y z\nDATA ascii\n", kMalformed, {"line 2", "POINTS"});
    expectError("k.pcd", "FIELDS x y z\nWIDTH 3\nHEIGHT 2\nPOINTS 5\nDATA ascii\n", kMalformed, {"5", "6"});
    expectError("l.pcd", "FIELDS x y z\nSIZE 4 4 2\nPOINTS 1\nDATA ascii\n1 2 3\n", kMalformed,
                {"'z'", "F2"});
    expectError("m.pcd", "FIELDS x y z\nCOUNT 1 1 2\nPOINTS 1\nDATA ascii\n1 2 3 3\n", kMalformed,
                {"'z'", "2 x"});
    expectError("n.pcd", "SIZE 4 4 4\n", kMalformed, {"line 1", "follow FIELDS"});
    expectError("o.pcd", xyz("18446744073709551615", "18446744073709551615", "ascii"), kMalformed,
                {"absurdly"});
    expectError("p.pcd", "POINTS 3\nDATA ascii\n", kMalformed, {"line 2", "FIELDS"});
}

TEST_F(Pcd, BodyDefectsNameLineOrByte) {
    expectError("a.pcd", xyz("2", "1", "ascii") + "1 2 3\n", kMalformed,
                {"after line 10", "2 points", "found 1"});
    expectError("b.pcd", xyz("1", "1", "ascii") + "1 2 3\n4 5 6\n", kMalformed, {"after the last"});
    expectError("c.pcd", xyz("1", "1", "ascii") + "1 2\n", kMalformed, {"line 10", "'z'", "nothing"});
    expectError("d.pcd", xyz("1", "1", "ascii") + "1 2 3 4\n", kMalformed, {"line 10", "'4'"});
    expectError("e.pcd", xyz("1", "1", "ascii") + "1 b 3\n", kMalformed, {"line 10", "'y'", "'b'"});
    const std::string start = xyz("2", "1", "binary");
    expectError("f.pcd", start + std::string(23, '\0'), kMalformed,
                {"byte " + std::to_string(start.size()), "2 points", "room for 1"});
}

TEST_F(Pcd, ReadsDataThatDidNotGetSmaller) {
    Bytes body;
    body.add(std::uint32_t{24}).add(std::uint32_t{24});
    for (const float c : {1.0F, 4.0F, 2.0F, 5.0F, 3.0F, 6.0F}) body.add(c);
    EXPECT_EQ(readGood("a.pcd", xyz("2", "1", "binary_compressed") + body.str()).points,
              (PointCloud{{1, 2, 3}, {4, 5, 6}}));
}

TEST_F(Pcd, RefusesDamagedCompressedData) {
    const std::string start = xyz("2", "1", "binary_compressed");
    const std::string body = compressedPcdBody(std::string(24, '\0'));
    EXPECT_EQ(readGood("good.pcd", start + body).points.size(), 2U);
    expectError("a.pcd", start + "abc", kMalformed, {"size"});
    expectError("b.pcd", start + body.substr(0, body.size() - 1), kMalformed, {"cut short"});
    expectError("c.pcd", xyz("3", "1", "binary_compressed") + body, kMalformed,
                {"unpack", "3 points of 12 bytes"});
    std::string damaged = body;
    damaged[8] = '\xff';
    expectError("d.pcd", start + damaged, kMalformed, {"damaged"});
    // Six bytes that claim 4 GiB: refused before anything is allocated.
    const Bytes lie = Bytes().add(std::uint32_t{6}).add(std::uint32_t{4294967292U}).text("abcdef");
    expectError("e.pcd", xyz("357913941", "1", "binary_compressed") + lie.str(), kMalformed, {"cut short"});
}

}  // namespace
}  // namespace shapedb
