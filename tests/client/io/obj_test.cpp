// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Obj = FileTest;

TEST_F(Obj, ReadsFilesWithoutFaces) {
    const Scan scan = readGood("a.obj", "v 1 2 3\nv 4 5 6 1.0\nv 7 8 9 0.5 0.5 0.5\np 1 2 3\n");
    EXPECT_EQ(scan.points, (PointCloud{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    EXPECT_EQ(scan.trianglesInFile, 0U);
}

TEST_F(Obj, ReadsNegativeForwardAndPolygonFaces) {
    const Scan scan = readGood("a.obj",
                               "f 1/1/1 2/2/2 3/3/3 4/4/4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\n"
                               "f -4//-1 -3//-1 -2//-1\nf 1 2 \\\n 3 4\nl 1 2\n");
    EXPECT_EQ(scan.verticesInFile, 4U);
    EXPECT_EQ(scan.trianglesInFile, 6U);
}

TEST_F(Obj, SamplesOfANegativeIndexFaceLieOnIt) {
    // The third vertex is far away; the face must be the last three.
    const std::string file = write("a.obj", "v 100 100 100\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n");
    ReadOptions options;
    options.meshHandling = MeshHandling::kSurface;
    options.meshSamples = 100;
    const auto scan = readScan(file, options);
    ASSERT_TRUE(scan) << scan.error().message;
    for (const Point3& p : scan->points) {
        EXPECT_NEAR(p.z, 5.0, 1e-12);
        EXPECT_LE(p.x + p.y, 1.0 + 1e-12);
    }
}

TEST_F(Obj, ReadsCapitalsWeightsAndColours) {
    const Scan scan = readGood(
        "a.obj", "V 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nV\t0 1 0\nVN 0 0 1\nF 1 2 3 4\nFo 1 2 3\n");
    EXPECT_EQ(scan.verticesInFile, 4U);
    EXPECT_EQ(scan.trianglesInFile, 3U);
}

TEST_F(Obj, ToleratesCommentsBlankLinesAndUnknownKeywords) {
    const Scan scan =
        readGood("a.obj",
                 "\xEF\xBB\xBF# c\r\n\r\ng group\r\nusemtl m\r\nvp 1 2\r\n  v   1\t2 3 # c\r\nv 2 2 2\r\n"
                 "v 3 2 1\r\ncurv2 1 2\r\nf 1 2 3\r\n");
    EXPECT_EQ(scan.verticesInFile, 3U);
    EXPECT_EQ(scan.trianglesInFile, 1U);
}

TEST_F(Obj, DefectsNameTheLine) {
    expectError("empty.obj", "", kMalformed, {"the file is empty"});
    expectError("a.obj", "MZ binary\n", kMalformed, {"no vertex"});
    expectError("b.obj", "v 1 2\n", kMalformed, {"line 1", "vertex 0", "nothing"});
    expectError("c.obj", "v 1 2 3\nv 1 abc 3\n", kMalformed, {"line 2", "vertex 1", "'abc'"});
    expectError("d.obj", "v 1 2 3\n\nf 1 1 2\n", kMalformed, {"line 3", "vertex 2", "has 1 vertex,"});
    expectError("e.obj", "v 1 2 3\nf -2 1 1\n", kMalformed, {"line 2", "vertex -2"});
    expectError("f.obj", "v 1 2 3\nf 0 1 1\n", kMalformed, {"line 2", "'0'", "from 1"});
    expectError("g.obj", "v 1 2 3\nf a b c\n", kMalformed, {"line 2", "'a'"});
    expectError("h.obj", "v 1 2 3\nf 99999999999999999999 1 1\n", kMalformed, {"line 2"});
    expectError("i.obj", "v 1 2 3\nf 4294967297 1 1\n", kMalformed, {"line 2", "4294967297"});
    expectError("j.obj", "v 1 2 3\nv nan 2 3\n", ErrorCode::kNonFiniteCoordinate, {"line 2", "vertex 1"});
}

}  // namespace
}  // namespace shapedb
