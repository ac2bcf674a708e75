// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the readers of scan files: any bytes give points or an error with a message, and nothing else.
// The first byte chooses the format, A for the first in scanFileEndings(), the rest is the file.
#include <cmath>

#include "client/io/scan_reader.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    fuzz::Input input(data, size);
    const auto& endings = scanFileEndings();
    const std::string ending = endings[static_cast<std::uint8_t>(input.byte() - 'A') % endings.size()];
    const std::string path = fuzz::writeFile(ending, input.rest());
    ReadOptions options;
    options.meshSamples = 50;
    options.maxPoints = 10'000;
    for (const MeshHandling handling :
         {MeshHandling::kAuto, MeshHandling::kVertices, MeshHandling::kSurface}) {
        options.meshHandling = handling;
        const auto scan = readScan(path, options);
        if (fuzz::valueOrExplained(scan) == nullptr) continue;
        require(scan->points.size() <= options.maxPoints, "no more points than allowed");
        for (const auto& p : scan->points) {
            require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "points are finite");
        }
    }
    std::remove(path.c_str());
    return 0;
}
