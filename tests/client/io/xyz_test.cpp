// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Xyz = FileTest;

TEST_F(Xyz, EverySeparatorGivesTheSamePoints) {
    const PointCloud expected = {{1.5, -2, 3e2}, {4, 5, 6}};
    for (const std::string text :
         {"1.5 -2 3e2\n4 5 6\n", "1.5\t-2\t3e2\n4\t5\t6\n", "1.5,-2,3e2\n4,5,6\n", "1.5;-2;3e2\n4;5;6\n",
          "1.5, -2, 3e2\n4 , 5 , 6\n", " 1.5  -2 \t 3e2 \r\n4 5 6", "1.5; -2; 3e2;\n4;5;6;\n",
          "1.5,-2,3e2,\n4,5,6, \n", "# c\n// c\n\n1.5 -2 3e2\n  # c\n4 5 6\n", "x y z\n1.5 -2 3e2\n4 5 6\n",
          "\"X\",\"Y\",\"Z\",R\n1.5,-2,3e2,9\n4,5,6,9\n",
          "\xEF\xBB\xBF"
          "2\n1.5 -2 3e2\n4 5 6\n",
          "1.5 -2 3e2 255 n/a\n4 5 6 -7\n", "\"1.5\",\"-2\",\"3e2\"\n\"4\",\"5\",\"6\"\n",
          "//X Y Z\n1.5 -2 3e2\n4 5 6\n"}) {
        EXPECT_EQ(readGood("a.xyz", text).points, expected) << text;
    }
}

TEST_F(Xyz, ReadsEveryEnding) {
    for (const std::string ending : {".xyz", ".txt", ".pts", ".asc", ".csv", ".XYZ"}) {
        EXPECT_EQ(readGood("a" + ending, "1 2 3\n").format, "XYZ text");
    }
}

TEST_F(Xyz, TakesTheColumnsThatAHeaderNames) {
    const PointCloud expected = {{1, 2, 3}, {4, 5, 6}};
    for (const std::string text :
         {"id,x,y,z\n7,1,2,3\n8,4,5,6\n", "z y x\n3 2 1\n6 5 4\n",
          "\"Z\";\"i\";\"Y\";\"X\"\n3;0;2;1\n6;0;5;4\n", "X [m], Y [m], Z [m]\n1,2,3\n4,5,6\n",
          "x(mm) y(mm) z(mm) r g b\n1 2 3 0 0 0\n4 5 6 0 0 0\n", "//Intensity,X,Y,Z\n0.5,1,2,3\n0.5,4,5,6\n",
          "# made by a test\n# t x y z\n0 1 2 3\n0 4 5 6\n", "2\nx y z\n1 2 3\n4 5 6\n",
          // A sentence, and columns that are where they are without a header.
          "# the axes x y z are in mm\n1 2 3\n4 5 6\n", "# x y z nx ny nz\n1 2 3 0 0 1\n4 5 6 0 0 1\n"}) {
        EXPECT_EQ(readGood("a.csv", text).points, expected) << text;
    }
    expectError("b.csv", "id,x,y,z\n7,1,2\n", kMalformed, {"line 2", "nothing"});
    expectError("c.csv", "lon,lat,height\n1,2,3\n", kMalformed, {"line 1", "'lon'"});
}

TEST_F(Xyz, ReadsSeveralCountedScans) {
    EXPECT_EQ(readGood("a.pts", "2\n1 2 3 -5 0 0 0\n4 5 6 -5 0 0 0\n1\n7 8 9 -5 0 0 0\n").points.size(), 3U);
    expectError("b.pts", "2\n1 2 3\n4 5 6\n2\n7 8 9\n", kMalformed, {"announces 4 points", "has 3"});
    expectError("c.pts", "1\n1 2 3\n4 5 6\n", kMalformed, {"announces 1 point,", "has 2"});
    expectError("d.pts", "1\n1 2 3\n18446744073709551615\n", kMalformed, {"line 3"});
}

TEST_F(Xyz, RefusesDecimalCommas) {
    for (const std::string text : {"1,5 2,5 3,5\n", "1,5;2,5;3,5\n", "1,5\t2,5\t3,5\n", "1,5; 2,5; 3,5\n"}) {
        expectError("a.xyz", "0 0 0\n" + text, kMalformed, {"line 2", "commas inside numbers"});
    }
}

TEST_F(Xyz, DefectsNameTheLine) {
    expectError("empty.xyz", "", kMalformed, {"the file is empty"});
    expectError("a.xyz", "# only\n\n", kMalformed, {"no point"});
    expectError("b.xyz", "1 2 3\n1 2\n", kMalformed, {"line 2", "nothing"});
    expectError("c.xyz", "1 2 3\n\n1 b 3\n", kMalformed, {"line 3", "'b'"});
    expectError("d.xyz", "3\n1 2 3\n1 2 3\n", kMalformed, {"announces 3", "has 2"});
    expectError("e.xyz", "C 0.0 1.0 2.0\n", kMalformed, {"line 1", "'C'"});
    expectError("f.xyz", "1 2 3\n7\n1 2 3\n", kMalformed, {"line 2"});
    expectError("g.xyz", "1,,2,3\n", kMalformed, {"line 1", "nothing"});
    expectError("h.xyz", "1 2 3\n1 2 nan\n", ErrorCode::kNonFiniteCoordinate, {"line 2", "vertex 1"});
}

}  // namespace
}  // namespace shapedb
