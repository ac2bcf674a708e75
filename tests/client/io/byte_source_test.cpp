// SPDX-License-Identifier: GPL-3.0-or-later
// Packed files, standard input and formats that the name does not say.
#include <cstdlib>
#include <string>

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Gzip = FileTest;
using ScanFormat = FileTest;

std::string packed(const std::string& bytes) {
    z_stream stream = {};
    EXPECT_EQ(::deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
    std::string result(::deflateBound(&stream, bytes.size()) + 64, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(result.data());
    stream.avail_out = static_cast<uInt>(result.size());
    EXPECT_EQ(::deflate(&stream, Z_FINISH), Z_STREAM_END);
    result.resize(stream.total_out);
    ::deflateEnd(&stream);
    return result;
}

TEST_F(Gzip, EveryFormatReadsAlikePackedAndNot) {
    for (const SampleFile& file : sampleFiles()) {
        const Scan plain = readGood(file.name, file.bytes);
        for (const std::string ending : {".gz", ".GZ", ""}) {
            const Scan scan = readGood("packed-" + file.name + ending, packed(file.bytes));
            EXPECT_EQ(scan.points, plain.points) << file.name << ending;
            EXPECT_EQ(scan.trianglesInFile, plain.trianglesInFile) << file.name;
            EXPECT_EQ(scan.format, plain.format) << file.name;
        }
        // Some programs unpack what they fetch and keep its name.
        EXPECT_EQ(readGood("unpacked-" + file.name + ".gz", file.bytes).points, plain.points) << file.name;
    }
}

TEST_F(Gzip, SeveralMembersAreOneFile) {
    const std::string two = packed("1 2 3\n4 5") + packed(" 6\n") + packed("");
    EXPECT_EQ(readGood("a.xyz.gz", two).points, (PointCloud{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(readGood("b.xyz.gz", two + std::string(600, '\0')).points.size(), 2U);
    EXPECT_EQ(readGood("c.xyz.gz", packed(std::string("\xFF\xFE") + std::string("1\0 \0"
                                                                                "2\0 \0"
                                                                                "3\0",
                                                                                10)))
                  .points,
              (PointCloud{{1, 2, 3}}));
}

TEST_F(Gzip, DamageIsNamed) {
    const std::string whole = packed("1 2 3\n4 5 6\n7 8 9\n");
    for (std::size_t length = 3; length < whole.size(); ++length) {
        expectError("a.xyz.gz", whole.substr(0, length), kMalformed, {"cut short"});
    }
    for (std::size_t i = 10; i < whole.size(); ++i) {
        std::string damaged = whole;
        damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
        EXPECT_FALSE(readVertices("b.xyz.gz", damaged)) << "byte " << i << " is not noticed";
    }
    expectError("c.xyz.gz", whole + "x", kMalformed, {"data after the gzip data"});
    expectError("d.xyz.gz", whole + std::string("\0\x1f\x8b\x08", 4), kMalformed,
                {"data after the gzip data"});
    expectError("e.xyz.gz", packed(""), kMalformed, {"the file is empty"});
    // One layer is unpacked.
    expectError("f.xyz.gz", packed(whole), kMalformed, {"f.xyz.gz"});
}

TEST_F(Gzip, BombsAreRefused) {
    std::string lines(std::size_t{66} << 20, '\n');
    expectError("a.xyz.gz", packed(lines), kMalformed, {"200 times", "gunzip"});
    // Much, but not more than numbers may shrink.
    const std::string mixed = packed("1 2 3\n" + lines.substr(0, std::size_t{60} << 20));
    EXPECT_EQ(readGood("b.xyz.gz", mixed).points.size(), 1U);
}

TEST_F(Gzip, FoldersAndKeysKnowPackedFiles) {
    write("set/cup/a.ply.gz", "");
    write("set/cup/b.PCD.GZ", "");
    write("set/cup/notes.txt.gz", packed("Scanned in 1998\n"));
    write("set/cup/points.txt.gz", packed("1 2 3\n"));
    write("set/cup/backup.tar.gz", "");
    const auto files = listScanFiles({path("set")});
    ASSERT_TRUE(files) << files.error().message;
    ASSERT_EQ(files->size(), 3U);
    EXPECT_EQ((*files)[2].path, path("set/cup/points.txt.gz"));
    EXPECT_EQ((*files)[0].label, "cup");
    EXPECT_EQ(withoutScanEnding("cup/a.ply.gz"), "cup/a");
    EXPECT_EQ(withoutScanEnding("cup/a.v2.PLY.GZ"), "cup/a.v2");
    EXPECT_EQ(withoutScanEnding("cup.gz/a.ply"), "cup.gz/a");
    EXPECT_EQ(listScanFiles({write("scan.dat", "")}).error().code, ErrorCode::kUnknownFileFormat);
    EXPECT_EQ(listScanFiles({path("scan.dat")}, true)->size(), 1U);
}

TEST_F(Gzip, OtherArchivesAreNamed) {
    for (const auto& [start, name] :
         std::vector<std::pair<std::string, std::string>>{{"PK\x03\x04", "ZIP"},
                                                          {"BZh91AY", "bzip2"},
                                                          {"\xfd"
                                                           "7zXZ",
                                                           "xz"},
                                                          {"\x28\xb5\x2f\xfd", "zstd"},
                                                          {"7z\xbc\xaf\x27\x1c", "7-Zip"}}) {
        for (const std::string ending : {".ply", ".xyz", ".stl", ".ply.gz"}) {
            expectError("a" + ending, start + std::string(200, '\1'), kMalformed, {name, "unpack it first"});
        }
    }
}

// Reads with a file as standard input.
Result<Scan> readStandardInput(const std::string& file, const ReadOptions& options) {
    const int before = ::dup(STDIN_FILENO);
    const int input = ::open(file.c_str(), O_RDONLY);
    ::dup2(input, STDIN_FILENO);
    auto scan = readScan("-", options);
    ::dup2(before, STDIN_FILENO);
    ::close(before);
    ::close(input);
    return scan;
}

TEST_F(ScanFormat, NamesTheFormatOfAnyFileAndOfStandardInput) {
    ReadOptions options;
    options.meshHandling = MeshHandling::kVertices;
    for (const SampleFile& file : sampleFiles()) {
        const std::string ending = file.name.substr(file.name.find('.'));
        const Scan plain = readGood(file.name, file.bytes);
        for (const std::string& format : {ending, ending.substr(1)}) {
            options.format = format;
            const auto scan = readScan(write("scan.dat", file.bytes), options);
            ASSERT_TRUE(scan) << scan.error().message;
            EXPECT_EQ(scan->points, plain.points) << file.name;
            const auto input = readStandardInput(path("scan.dat"), options);
            ASSERT_TRUE(input) << input.error().message;
            EXPECT_EQ(input->points, plain.points) << file.name;
            const auto packedInput = readStandardInput(write("packed", packed(file.bytes)), options);
            ASSERT_TRUE(packedInput) << packedInput.error().message;
            EXPECT_EQ(packedInput->points, plain.points) << file.name;
        }
    }
}

TEST_F(ScanFormat, ErrorsNameStandardInputAndTheFormats) {
    const std::string file = write("a", "1 2\n");
    auto scan = readStandardInput(file, {});
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(scan.error().message.find(".ply .pcd"), std::string::npos) << scan.error().message;
    ReadOptions options;
    options.format = "xyz";
    scan = readStandardInput(file, options);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().message.rfind("standard input: line 1", 0), 0U) << scan.error().message;
    options.format = "doc";
    scan = readScan(file, options);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(scan.error().message.find("'doc'"), std::string::npos) << scan.error().message;
}

}  // namespace
}  // namespace shapedb
