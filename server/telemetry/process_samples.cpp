// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <fstream>

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include "server/telemetry/metrics.h"

namespace shapedb::telemetry {
namespace {

double openFiles() {
    DIR* directory = ::opendir("/proc/self/fd");
    if (directory == nullptr) return 0.0;
    int count = 0;
    while (::readdir(directory) != nullptr) ++count;
    ::closedir(directory);
    return count - 3;  // ".", ".." and the directory itself
}

double maxFiles() {
    rlimit limit{};
    return ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? static_cast<double>(limit.rlim_cur) : 0.0;
}

double processorSeconds() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Memory {
    double all = 0.0;  ///< bytes of address space
    double resident = 0.0;
};

Memory memoryInUse() {
    double all = 0.0, resident = 0.0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    const auto page = static_cast<double>(::sysconf(_SC_PAGESIZE));
    return {all * page, resident * page};
}

}  // namespace

std::vector<Sample> sampleProcess(std::chrono::system_clock::time_point started) {
    const Memory memory = memoryInUse();
    return {{"process_resident_memory_bytes", "Memory in use.", Sample::Kind::kGauge, memory.resident},
            {"process_virtual_memory_bytes", "Address space in use.", Sample::Kind::kGauge, memory.all},
            {"process_open_fds", "Open files and connections.", Sample::Kind::kGauge, openFiles()},
            {"process_max_fds", "The most that may be open.", Sample::Kind::kGauge, maxFiles()},
            {"process_cpu_seconds_total", "Processor time used.", Sample::Kind::kCounter, processorSeconds()},
            {"process_start_time_seconds", "When the process started, since 1970 (UTC).",
             Sample::Kind::kGauge, std::chrono::duration<double>(started.time_since_epoch()).count()}};
}

}  // namespace shapedb::telemetry
