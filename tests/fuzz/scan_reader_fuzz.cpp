// Fuzzes the readers of scan files: any bytes give points or an error with a message, and nothing else.
// The first byte chooses the format, the rest is the file.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <unistd.h>

#include "client/io/scan_reader.h"

namespace {

using shapedb::MeshHandling;

/// Stays in memory: /dev/shm is a tmpfs.
const std::string& pathWithoutEnding() {
    static const std::string path = "/dev/shm/shapedb-fuzz-" + std::to_string(::getpid());
    return path;
}

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "violated: %s\n", what);
    std::abort();
}

void write(const std::string& path, const std::uint8_t* data, std::size_t size) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    require(file != nullptr, "the fuzzer can write its file");
    require(std::fwrite(data, 1, size, file) == size, "the fuzzer can write its file");
    std::fclose(file);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const auto& endings = shapedb::scanFileEndings();
    const std::string path = pathWithoutEnding() + endings[data[0] % endings.size()];
    write(path, data + 1, size - 1);
    shapedb::ReadOptions options;
    options.meshSamples = 50;
    options.maxPoints = 10'000;
    for (const MeshHandling handling :
         {MeshHandling::kAuto, MeshHandling::kVertices, MeshHandling::kSurface}) {
        options.meshHandling = handling;
        const auto scan = shapedb::readScan(path, options);
        if (!scan) {
            require(!scan.error().message.empty(), "errors have a message");
            continue;
        }
        require(scan->points.size() <= options.maxPoints, "no more points than allowed");
        for (const auto& p : scan->points) {
            require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "points are finite");
        }
    }
    std::remove(path.c_str());
    return 0;
}
