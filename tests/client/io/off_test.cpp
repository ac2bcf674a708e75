// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Off = FileTest;

TEST_F(Off, ReadsEveryHeaderSpelling) {
    const std::string body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for (const std::string start :
         {"OFF\n3 1 3\n", "OFF\n3 1\n", "OFF 3 1 3\n", "OFF3 1 3\n", "3 1 3\n",
          "# first\n\nOFF # c\n#\n3 1 3 # c\n", "COFF\n3 1 3\n", "NOFF\n3 1 3\n", "STOFF\n3 1 3\n",
          "CNOFF\n3 1 3\n", "STCNOFF\n3 1 3\n", "\xEF\xBB\xBFOFF\n3 1 3\n", "OFF\r\n3 1 3\r\n"}) {
        const Scan scan = readGood("a.off", start + body);
        EXPECT_EQ(scan.points, (PointCloud{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})) << start;
        EXPECT_EQ(scan.trianglesInFile, 1U) << start;
    }
}

TEST_F(Off, ReadsPrefixesInLowerCaseAndCountsOverLines) {
    const std::string body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for (const std::string start : {"off\n3 1 3\n", "Off 3 1 3\n", "off3 1 3\n", "coff\n3 1 3\n",
                                    "noff\n3 1 3\n", "stcnoff\n3 1 3\n", "OFF\n3 1\n3\n", "OFF\n3\n1\n3\n",
                                    "OFF\n3\n1\n", "OFF\n3\n1 3\n", "OFF 3\n\n1 # c\n3\n", "3\n1\n3\n"}) {
        const Scan scan = readGood("a.off", start + body);
        EXPECT_EQ(scan.points, (PointCloud{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})) << start;
        EXPECT_EQ(scan.trianglesInFile, 1U) << start;
    }
    // Word by word the prefix says how many numbers a vertex has.
    EXPECT_EQ(readGood("b.off", "STNOFF 3 1 0 0 0 0 0 0 1 .5 .5 1 0 0 0 0 1 .5 .5 0 1 0 0 0 1 .5 .5 3 0 1 2")
                  .points,
              (PointCloud{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    expectError("c.off", "nOFF\n3\n3 1 3\n" + body, kMalformed, {"line 1", "'nOFF'"});
    expectError("d.off", "4off\n3 1 3\n" + body, kMalformed, {"line 1", "'4off'"});
    expectError("e.off", "off binary\n", kMalformed, {"binary OFF"});
}

TEST_F(Off, ReadsExtraColumnsCommentsAndPolygons) {
    const Scan scan = readGood("a.off",
                               "COFF\n5 2 0\n0 0 0 255 0 0 255\n1 0 0 0.5 0.5 0.5 1 # red\n\n1 1 0\n0 1 0 7\n"
                               "0.5 2 0\n5 0 1 2 4 3 0.1 0.2 0.3\n# between\n3 0 1 2\n# end\n\n");
    EXPECT_EQ(scan.verticesInFile, 5U);
    EXPECT_EQ(scan.trianglesInFile, 4U);
}

TEST_F(Off, DefectsNameTheLine) {
    expectError("empty.off", "", kMalformed, {"the file is empty"});
    expectError("a.off", "OBJ\n", kMalformed, {"line 1", "'OBJ'"});
    expectError("b.off", "OFF BINARY\n", kMalformed, {"line 1", "binary OFF"});
    expectError("c.off", "4OFF\n1 0 0\n1 2 3 4\n", kMalformed, {"line 1", "'4OFF'"});
    expectError("d.off", "OFF\n", kMalformed, {"after line 1", "numbers of vertices"});
    expectError("e.off", "OFF\n2 -1 0\n", kMalformed, {"line 2", "'-1'"});
    expectError("f.off", "OFF\n2 0 0\n1 2 3\n", kMalformed, {"after line 3", "vertex 1 of 2"});
    expectError("g.off", "OFF\n2 0 0\n1 2 3\n1 2\n", kMalformed, {"after line 4", "vertex 1 of 2"});
    expectError("h.off", "OFF\n1 1 0\n1 2 3\n", kMalformed, {"after line 3", "face 0 of 1"});
    expectError("i.off", "OFF\n1 1 0\n1 2 3\n3 0 0\n", kMalformed, {"line 4", "corner 2"});
    expectError("j.off", "OFF\n1 1 0\n1 2 3\n3 0 0 1\n", kMalformed, {"line 4", "vertex 1", "has 1 vertex,"});
    expectError("k.off", "OFF\n1 0 0\n1 2 3\n4 5 6\n", kMalformed, {"line 4", "after the last"});
    expectError("l.off", "OFF\n1 1 0\n1 2 3\nthree 0 0 1\n", kMalformed, {"line 4", "'three'"});
    expectError("m.off", "OFF\n2 0 0\n1 2 3\n1 inf 3\n", ErrorCode::kNonFiniteCoordinate,
                {"line 4", "vertex 1"});
}

}  // namespace
}  // namespace shapedb
