// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/io/scan_reader.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>

#include <sys/stat.h>
#include <unistd.h>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

namespace fs = std::filesystem;

using ScanReader = FileTest;
using ScanFiles = FileTest;
using SharedData = FileTest;

// The unit square, divided into cells x cells squares, as OFF.
std::string grid(std::size_t cells) {
    const std::size_t side = cells + 1;
    std::string text = "OFF\n" + std::to_string(side * side) + " " + std::to_string(cells * cells) + " 0\n";
    for (std::size_t i = 0; i < side * side; ++i) {
        text += std::to_string(static_cast<double>(i % side) / static_cast<double>(cells)) + " " +
                std::to_string(static_cast<double>(i / side) / static_cast<double>(cells)) + " 0\n";
    }
    for (std::size_t i = 0; i < cells * cells; ++i) {
        const std::size_t a = i / cells * side + i % cells;
        text += "4 " + std::to_string(a) + " " + std::to_string(a + 1) + " " + std::to_string(a + side + 1) +
                " " + std::to_string(a + side) + "\n";
    }
    return text;
}

TEST_F(ScanReader, EveryFormatGivesTheSamePoints) {
    for (const SampleFile& file : sampleFiles()) {
        const Scan scan = readGood(file.name, file.bytes);
        EXPECT_EQ(scan.verticesInFile, file.vertices) << file.name;
        EXPECT_EQ(scan.trianglesInFile, file.triangles) << file.name;
        EXPECT_FALSE(scan.sampledFromMesh) << file.name;
        EXPECT_FALSE(scan.format.empty()) << file.name;
        PointCloud expected = sampleVertices();
        expected.resize(file.vertices);
        PointCloud points = scan.points;
        // STL has no vertex order.
        std::sort(points.begin(), points.end(), lexicographicLess);
        std::sort(expected.begin(), expected.end(), lexicographicLess);
        EXPECT_EQ(points, expected) << file.name;
        if (file.name.find(".stl") == std::string::npos) {
            EXPECT_EQ(scan.points, sampleVertices()) << file.name;
        }
    }
}

TEST_F(ScanReader, SamplesMeshesUniformlyByAreaWithASeed) {
    const std::string file = write("square.off", grid(3));
    ReadOptions options;
    options.meshSamples = 5000;
    const auto scan = readScan(file, options);
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_TRUE(scan->sampledFromMesh);
    EXPECT_EQ(scan->verticesInFile, 16U);
    EXPECT_EQ(scan->trianglesInFile, 18U);
    ASSERT_EQ(scan->points.size(), 5000U);
    // A quarter of the points in every quarter of the square, within five standard deviations.
    for (const double x : {0.0, 0.5}) {
        for (const double y : {0.0, 0.5}) {
            const auto count = std::count_if(scan->points.begin(), scan->points.end(), [&](const Point3& p) {
                return p.x >= x && p.x < x + 0.5 && p.y >= y && p.y < y + 0.5 && p.z == 0.0;
            });
            EXPECT_NEAR(static_cast<double>(count), 1250.0, 5.0 * std::sqrt(5000.0 * 0.25 * 0.75));
        }
    }
    EXPECT_EQ(readScan(file, options)->points, scan->points);
    options.seed = 2;
    EXPECT_NE(readScan(file, options)->points, scan->points);
}

TEST_F(ScanReader, AutoTakesVerticesThatAreDenserThanSamples) {
    const std::string file = write("dense.off", grid(40));
    ReadOptions options;
    options.meshSamples = 1681;
    auto scan = readScan(file, options);
    ASSERT_TRUE(scan);
    EXPECT_FALSE(scan->sampledFromMesh);
    EXPECT_EQ(scan->points.size(), 1681U);
    options.meshSamples = 1682;
    EXPECT_TRUE(readScan(file, options)->sampledFromMesh);
    options.meshSamples = 100;
    options.meshHandling = MeshHandling::kSurface;
    scan = readScan(file, options);
    EXPECT_TRUE(scan->sampledFromMesh);
    EXPECT_EQ(scan->points.size(), 100U);
    options.meshHandling = MeshHandling::kVertices;
    options.meshSamples = 100000;
    EXPECT_FALSE(readScan(file, options)->sampledFromMesh);
}

TEST_F(ScanReader, AutoSamplesMeshesWithLargeFaces) {
    // The dense square and one large triangle: more vertices than samples, but not everywhere.
    std::string text = grid(40);
    text.replace(0, text.find('\n', 4), "OFF\n1684 1601 0");
    const std::size_t faces = text.find("\n4 ") + 1;
    text.insert(faces, "10 0 0\n30 0 0\n10 20 0\n");
    text += "3 1681 1682 1683\n";
    ReadOptions options;
    options.meshSamples = 1000;
    const auto scan = readScan(write("bare.off", text), options);
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_TRUE(scan->sampledFromMesh);
}

TEST_F(ScanReader, AutoTakesVerticesOfCloudsWithFewOrFlatFaces) {
    auto scan = readScan(
        write("few.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 2 2\nv 3 3 3\nv 4 4 4\nv 5 5 5\nf 1 2 3\n"));
    ASSERT_TRUE(scan);
    EXPECT_FALSE(scan->sampledFromMesh);
    EXPECT_EQ(scan->points.size(), 7U);
    scan = readScan(write("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"));
    ASSERT_TRUE(scan);
    EXPECT_FALSE(scan->sampledFromMesh);
    scan = readScan(write("huge.obj", "v 0 0 0\nv 1e300 0 0\nv 0 1e300 0\nf 1 2 3\n"));
    ASSERT_TRUE(scan);
    EXPECT_EQ(scan->points.size(), 3U);
}

TEST_F(ScanReader, SurfaceNeedsTrianglesWithArea) {
    ReadOptions options;
    options.meshHandling = MeshHandling::kSurface;
    auto scan = readScan(write("points.xyz", "1 2 3\n"), options);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(scan.error().message.find("no triangles"), std::string::npos);
    scan = readScan(write("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), options);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kMalformedFile);
    EXPECT_NE(scan.error().message.find("line.obj"), std::string::npos);
    options.meshSamples = 0;
    EXPECT_EQ(readScan(path("line.obj"), options).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ScanReader, PointLimitHoldsInEveryFormat) {
    ReadOptions options;
    options.meshHandling = MeshHandling::kVertices;
    for (const SampleFile& file : sampleFiles()) {
        const std::string full = write(file.name, file.bytes);
        options.maxPoints = file.vertices;
        EXPECT_TRUE(readScan(full, options)) << file.name;
        options.maxPoints = file.vertices - 1;
        const auto scan = readScan(full, options);
        ASSERT_FALSE(scan) << file.name;
        EXPECT_EQ(scan.error().code, ErrorCode::kPointLimitExceeded) << scan.error().message;
        EXPECT_NE(scan.error().message.find(std::to_string(file.vertices - 1)), std::string::npos);
    }
    options.meshHandling = MeshHandling::kAuto;
    options.maxPoints = 10;
    EXPECT_EQ(readScan(path("plain.off"), options).error().code, ErrorCode::kPointLimitExceeded);
}

TEST_F(ScanReader, ErrorsNameUnreadableAndUnknownFiles) {
    auto scan = readScan(path("missing.ply"));
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kFileNotReadable);
    EXPECT_NE(scan.error().message.find("missing.ply"), std::string::npos);
    fs::create_directory(path("folder.ply"));
    scan = readScan(path("folder.ply"));
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kFileNotReadable);
    EXPECT_NE(scan.error().message.find("folder"), std::string::npos);
    if (::geteuid() != 0) {  // root can read everything
        ::chmod(write("secret.ply", "ply\n").c_str(), 0);
        EXPECT_EQ(readScan(path("secret.ply")).error().code, ErrorCode::kFileNotReadable);
    }
    for (const char* name : {"scan.e57", "scan", "scan.gz", "scan.zip.gz", ".ply"}) {
        scan = readScan(write(name, "ply\n"));
        ASSERT_FALSE(scan);
        EXPECT_EQ(scan.error().code, ErrorCode::kUnknownFileFormat) << name;
        for (const std::string& ending : scanFileEndings()) {
            EXPECT_NE(scan.error().message.find(ending), std::string::npos) << scan.error().message;
        }
    }
}

TEST_F(ScanReader, UnknownEndingsComeWithAWayOut) {
    for (const auto& [name, advice] :
         std::vector<std::pair<std::string, std::string>>{{"a.laz", "laszip"},
                                                          {"a.LAZ.gz", "laszip"},
                                                          {"a.e57", "CloudCompare"},
                                                          {"a.fbx", "Blender"},
                                                          {"a.step", "FreeCAD"},
                                                          {"a.vtk", "meshio"},
                                                          {"a.zip", "unpack"},
                                                          {"a.doc", "scan files end in .ply"}}) {
        const auto scan = readScan(write(name, "data"));
        ASSERT_FALSE(scan);
        EXPECT_EQ(scan.error().code, ErrorCode::kUnknownFileFormat);
        EXPECT_NE(scan.error().message.find(advice), std::string::npos) << scan.error().message;
    }
}

TEST_F(ScanReader, NamesEachFormatOnce) {
    EXPECT_EQ(scanFormatList(), "PLY, PCD, OFF, OBJ, STL, LAS, GLTF, 3MF or XYZ");
}

TEST_F(ScanReader, ReadsPipes) {
    for (const SampleFile& file : sampleFiles()) {
        const std::string pipe = path("pipe-" + file.name);
        ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
        std::thread writer([&] { write("pipe-" + file.name, file.bytes); });
        ReadOptions options;
        options.meshHandling = MeshHandling::kVertices;
        const auto scan = readScan(pipe, options);
        writer.join();
        ASSERT_TRUE(scan) << scan.error().message;
        EXPECT_EQ(scan->verticesInFile, file.vertices) << file.name;
    }
}

TEST_F(ScanReader, ReportsProgressAndCanBeCancelled) {
    std::string text;
    for (int i = 0; i < 300000; ++i) text += "1.5 2.5 3.5\n";
    const std::string file = write("long.xyz", text);
    std::atomic<bool> cancel = false;
    RunContext context;
    context.cancel = &cancel;
    std::uint64_t last = 0;
    context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t total) {
        EXPECT_STREQ(stage, "read");
        EXPECT_EQ(total, text.size());
        EXPECT_GT(done, last);
        last = done;
    };
    EXPECT_TRUE(readScan(file, {}, context));
    EXPECT_EQ(last, text.size());
    last = 0;
    context.progress = [&](const char*, std::uint64_t, std::uint64_t) { cancel = true; };
    EXPECT_EQ(readScan(file, {}, context).error().code, ErrorCode::kCancelled);
    cancel = false;
    context.progress = nullptr;
    context.deadline = RunContext::Clock::now();
    EXPECT_EQ(readScan(file, {}, context).error().code, ErrorCode::kDeadlineExceeded);
}

TEST_F(ScanFiles, SearchesFoldersAndLabelsByFolder) {
    write("scans/hand/b.ply", "");
    write("scans/hand/A.PCD", "");
    write("scans/cup/deep/c.off", "");
    write("scans/cup/points.txt", "# c\n12\n1 2 3\n");
    write("scans/cup/README.txt", "Scanned in 1998\n");
    write("scans/cup/notes.md", "");
    write("scans/.hidden/d.ply", "");
    write("scans/cup/.e.ply", "");
    fs::create_directory_symlink(path("scans"), path("scans/loop"));
    fs::create_symlink(path("nothing"), path("scans/cup/dangling.ply"));
    const auto files = listScanFiles({path("scans"), path("scans/hand/../hand/b.ply")});
    ASSERT_TRUE(files) << files.error().message;
    std::vector<std::pair<std::string, std::string>> got;
    for (const ScanFile& file : *files) got.emplace_back(file.path.substr(folder().size() + 1), file.label);
    EXPECT_EQ(got, (std::vector<std::pair<std::string, std::string>>{{"scans/cup/deep/c.off", "deep"},
                                                                     {"scans/cup/points.txt", "cup"},
                                                                     {"scans/hand/A.PCD", "hand"},
                                                                     {"scans/hand/b.ply", "hand"}}));
}

TEST_F(ScanFiles, SayWhatSharesItsNameInItsFolder) {
    for (const char* name :
         {"s/box.stl", "s/box.obj", "s/cup.ply", "s/jug.ply", "s/sub/cup.obj", "s/can.xyz.gz"}) {
        write(name, "");
    }
    write("s/cup.txt", "the cup is blue\n");
    write("s/jug.txt", "1 2 3\n4 5 6\n");
    write("s/.cup.obj", "");
    std::vector<std::string> sharing;
    const auto files = listScanFiles({path("s")});
    ASSERT_TRUE(files);
    for (const ScanFile& file : *files) {
        if (file.sharesName) sharing.push_back(file.path.substr(path("s").size() + 1));
    }
    EXPECT_EQ(sharing, (std::vector<std::string>{"box.obj", "box.stl", "jug.ply", "jug.txt"}))
        << "notes and hidden files are no scans, folders have names of their own";
    EXPECT_TRUE(listScanFiles({path("s/box.stl")})->front().sharesName) << "also of one that is given alone";
    EXPECT_FALSE(listScanFiles({path("s/cup.ply")})->front().sharesName);
}

TEST_F(ScanFiles, ErrorsNameBadPaths) {
    EXPECT_EQ(listScanFiles({path("missing")}).error().code, ErrorCode::kFileNotReadable);
    const auto unknown = listScanFiles({write("a.e57", "")});
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::kUnknownFileFormat);
    fs::create_directory(path("empty"));
    const auto empty = listScanFiles({path("empty")});
    ASSERT_FALSE(empty);
    EXPECT_EQ(empty.error().code, ErrorCode::kFileNotReadable);
    EXPECT_NE(empty.error().message.find("no scan file"), std::string::npos);
    EXPECT_TRUE(listScanFiles({})->empty());
}

TEST_F(SharedData, PublicScansHaveTheirKnownCounts) {
    const char* data = std::getenv("SHAPEDB_DATA");
    if (data == nullptr) {
        std::cout << "SHAPEDB_DATA is not set: public scans are not read\n";
        return;
    }
    struct Known {
        const char* name;
        std::size_t vertices;
        std::size_t triangles;  // 0: not checked
        bool sampled;
    };
    for (const Known& known :
         {Known{"scans/bunny-ten-range-scans.ply", 362271, 0, false},
          Known{"scans/bunny-range-scan-000.ply", 40256, 0, false},
          Known{"scans/bunny-zippered.ply", 35947, 0, false}, Known{"scans/igea.ply", 134345, 268686, false},
          Known{"meshes/cow.obj", 2903, 5804, true}, Known{"meshes/fandisk.obj", 6475, 12946, true},
          Known{"meshes/rocker-arm.obj", 10044, 20088, true}, Known{"meshes/spot.obj", 2930, 5856, true}}) {
        const auto scan = readScan(std::string(data) + "/" + known.name);
        ASSERT_TRUE(scan) << scan.error().message;
        EXPECT_EQ(scan->verticesInFile, known.vertices) << known.name;
        if (known.triangles != 0) {
            EXPECT_EQ(scan->trianglesInFile, known.triangles) << known.name;
        }
        EXPECT_EQ(scan->sampledFromMesh, known.sampled) << known.name;
        EXPECT_EQ(scan->points.size(), known.sampled ? 20000U : known.vertices) << known.name;
    }
}

}  // namespace
}  // namespace shapedb
