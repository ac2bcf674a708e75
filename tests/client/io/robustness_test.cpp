// SPDX-License-Identifier: GPL-3.0-or-later
// Truncated, damaged and false files: any bytes give a value or an error, and memory grows with the bytes
// that are there, not with what a header announces.
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <string>

#include "core/base/random.h"
#include "tests/client/io/test_files.h"

namespace {

std::atomic<std::size_t> largestAllocation{0};

void* countedOrNull(std::size_t size) noexcept {
    std::size_t seen = largestAllocation.load();
    while (size > seen && !largestAllocation.compare_exchange_weak(seen, size)) {
    }
    return std::malloc(size == 0 ? 1 : size);
}

void* countedAllocation(std::size_t size) {
    void* memory = countedOrNull(size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

}  // namespace

void* operator new(std::size_t size) { return countedAllocation(size); }
void* operator new[](std::size_t size) { return countedAllocation(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return countedOrNull(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return countedOrNull(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace shapedb {
namespace {

using Robustness = FileTest;

// The read buffer is 1 MiB; for files of a few hundred bytes nothing else may be larger.
constexpr std::size_t kMostForASmallFile = std::size_t{2} << 20;

void expectSaneResult(const Result<Scan>& scan, const std::string& name, std::size_t bytes) {
    if (!scan) {
        EXPECT_FALSE(scan.error().message.empty()) << name;
        EXPECT_NE(scan.error().code, ErrorCode::kInternal) << scan.error().message;
        EXPECT_NE(scan.error().code, ErrorCode::kOutOfMemory) << scan.error().message;
        EXPECT_EQ(scan.error().message.find_first_of("\n\r\t\x1b"), std::string::npos)
            << scan.error().message;
        return;
    }
    // The densest format packs 22 points into 3 bytes (compressed PCD).
    EXPECT_LE(scan->verticesInFile, 8 * bytes) << name;
    for (const Point3& p : scan->points)
        EXPECT_TRUE(std::isfinite(p.x + p.y + p.z) || std::isfinite(p.x)) << name;
}

TEST_F(Robustness, FilesCutAtEveryByteGiveAnErrorOrFewerPoints) {
    for (const SampleFile& file : sampleFiles()) {
        for (std::size_t length = 0; length < file.bytes.size(); ++length) {
            largestAllocation = 0;
            const auto scan = readVertices(file.name, file.bytes.substr(0, length));
            EXPECT_LT(largestAllocation.load(), kMostForASmallFile) << file.name;
            expectSaneResult(scan, file.name, length);
            if (!scan) continue;
            EXPECT_LE(scan->verticesInFile, file.vertices) << file.name << " cut at " << length;
        }
    }
}

TEST_F(Robustness, BinaryAndCountedFilesNeverPassWhenCut) {
    for (const SampleFile& file : sampleFiles()) {
        const bool noCount = file.name == "plain.xyz" || file.name == "crlf.txt" || file.name == "plain.obj";
        if (noCount) continue;
        // A cut inside the last number or line end of a text file cannot be detected.
        const std::size_t lastLine = file.bytes.find_last_of('\n', file.bytes.size() - 3);
        const bool text = file.bytes.back() == '\n';
        const std::size_t end = text ? lastLine : file.bytes.size();
        for (std::size_t length = 0; length < end; ++length) {
            EXPECT_FALSE(readVertices(file.name, file.bytes.substr(0, length)))
                << file.name << " cut at " << length;
        }
    }
}

TEST_F(Robustness, RandomDamageNeverCrashes) {
    Random random(20240607);
    const std::vector<SampleFile> files = sampleFiles();
    for (int round = 0; round < 6000; ++round) {
        const SampleFile& file = files[random.below(files.size())];
        std::string bytes = file.bytes;
        for (std::uint64_t i = 0, flips = 1 + random.below(4); i < flips; ++i) {
            char& byte = bytes[random.below(bytes.size())];
            // Digits give wrong numbers, blanks missing ones, random bytes everything else.
            switch (random.below(4)) {
                case 0: byte = static_cast<char>('0' + random.below(10)); break;
                case 1: byte = " \n-.e#/"[random.below(7)]; break;
                case 2: byte = static_cast<char>(byte ^ (1 << random.below(8))); break;
                default: byte = static_cast<char>(random.below(256)); break;
            }
        }
        if (random.below(8) == 0) bytes.insert(random.below(bytes.size()), std::to_string(random.next()));
        if (random.below(8) == 0) bytes.erase(random.below(bytes.size()), random.below(20));
        largestAllocation = 0;
        ReadOptions options;
        options.meshSamples = 50;
        const auto scan = readScan(write(file.name, bytes), options);
        EXPECT_LT(largestAllocation.load(), kMostForASmallFile) << file.name << " in round " << round;
        expectSaneResult(scan, file.name, bytes.size());
    }
}

TEST_F(Robustness, FalseHeadersAllocateNothing) {
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    const std::string tenPoints = std::string(120, '\1');
    std::string tenLines;
    for (int i = 0; i < 10; ++i) tenLines += "1 2 3\n";
    const std::string plyList = "element face 1\nproperty list uint int vertex_indices\nend_header\n";
    const std::string stlHeader(80, ' ');
    const std::vector<std::pair<std::string, std::string>> lies = {
        {"a.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\n" + xyz + "end_header\n" +
                      tenPoints},
        {"b.ply", "ply\nformat ascii 1.0\nelement vertex 1000000000\n" + xyz + "end_header\n" + tenLines},
        {"c.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n" + xyz +
                      "property list uchar uchar extra\nend_header\n" + tenPoints},
        {"d.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + xyz + plyList +
                      tenPoints.substr(0, 12) + "\xff\xff\xff\xff" + std::string(40, '\0')},
        {"e.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + plyList + "1 2 3\n4294967295 0 0 0\n"},
        {"f.ply",
         "ply\nformat binary_big_endian 1.0\nelement junk 18446744073709551615\nproperty double a\n"
         "element vertex 10\n" +
             xyz + "end_header\n" + tenPoints},
        {"a.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1000000000\nDATA binary\n" + tenPoints},
        {"b.pcd", "FIELDS x y z\nPOINTS 1000000000\nDATA ascii\n" + tenLines},
        {"c.pcd",
         "FIELDS x y z junk\nSIZE 4 4 4 8\nTYPE F F F F\nCOUNT 1 1 1 4294967295\nPOINTS 10\nDATA binary\n" +
             tenPoints},
        {"d.pcd", "FIELDS x y z\nPOINTS 100000000\nDATA binary_compressed\n" +
                      Bytes().add(std::uint32_t{100}).add(std::uint32_t{1200000000}).str() + tenPoints},
        {"a.off", "OFF 1000000000 0 0\n" + tenLines},
        {"b.off", "OFF 10 4000000000 0\n" + tenLines + "1000000000 1 2 3\n"},
        {"a.stl", stlHeader + Bytes().add(std::uint32_t{4294967295U}).str() + tenPoints},
        {"a.pts", "1000000000\n" + tenLines},
        {"a.obj", "v 1 2 3\nf 1 4294967295 1\n"},
    };
    for (const auto& [name, bytes] : lies) {
        largestAllocation = 0;
        const auto scan = readVertices(name, bytes);
        EXPECT_LT(largestAllocation.load(), kMostForASmallFile) << name;
        ASSERT_FALSE(scan) << name;
        EXPECT_EQ(scan.error().code, ErrorCode::kMalformedFile) << scan.error().message;
    }
}

TEST_F(Robustness, FalseHeadersFromPipesAllocateNothing) {
    const std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float x\nproperty float "
        "y\n"
        "property float z\nend_header\n" +
        std::string(120, '\1');
    const std::string command = "mkfifo '" + path("pipe.ply") + "'";
    ASSERT_EQ(std::system(command.c_str()), 0);
    const std::string full = write("source.ply", bytes);
    ASSERT_EQ(std::system(("cat '" + full + "' > '" + path("pipe.ply") + "' &").c_str()), 0);
    largestAllocation = 0;
    const auto scan = readScan(path("pipe.ply"));
    EXPECT_LT(largestAllocation.load(), kMostForASmallFile);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::kMalformedFile);
    EXPECT_NE(scan.error().message.find("vertex 10 of 1000000000"), std::string::npos)
        << scan.error().message;
}

}  // namespace
}  // namespace shapedb
