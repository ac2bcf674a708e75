// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/measuring.h"

#include <fstream>
#include <string>

#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

namespace shapedb::bench {

namespace {

// VmHWM of this process in bytes, or 0 if unknown.
std::size_t highWater() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("VmHWM:", 0) == 0) return 1024 * std::stoull(line.substr(6));
    }
    return 0;
}

// Reads what the child wrote. Its mark includes the memory it shares with this process.
std::size_t highWaterOfChild(const std::function<bool()>& work) {
    int ends[2];
    if (pipe(ends) != 0) return 0;
    const pid_t child = fork();
    if (child == 0) {
        std::size_t peak = 0;
        try {
            if (work()) peak = highWater();
        } catch (...) {
            peak = 0;
        }
        const bool written = write(ends[1], &peak, sizeof(peak)) == static_cast<ssize_t>(sizeof(peak));
        _exit(written ? 0 : 1);
    }
    close(ends[1]);
    std::size_t peak = 0;
    const bool read = child > 0 && ::read(ends[0], &peak, sizeof(peak)) == static_cast<ssize_t>(sizeof(peak));
    close(ends[0]);
    if (child > 0) waitpid(child, nullptr, 0);
    return read ? peak : 0;
}

}  // namespace

std::optional<std::size_t> peakMemoryOf(const std::function<bool()>& work) {
    malloc_trim(0);
    const std::size_t base = highWaterOfChild([] { return true; });
    const std::size_t peak = highWaterOfChild(work);
    if (base == 0 || peak < base) return std::nullopt;
    return peak - base;
}

}  // namespace shapedb::bench
