// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/output.h"

#include <array>
#include <cstdio>
#include <ctime>
#include <fstream>

#include <nlohmann/json.hpp>

#include "client/cli/evaluation_run.h"
#include "client/cli/text.h"
#include "client/io/output_file.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

constexpr const char* kStandardOutput = "-";

}  // namespace

std::string numberText(const char* format, double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

Result<void> writeText(const std::string& path, std::string_view text) {
    auto file = io::OutputFile::create(path);
    RETURN_IF_ERROR(file);
    RETURN_IF_ERROR(file->write(text));
    return file->commit();
}

void announceJson(cli::Console& console, const std::string& target) {
    console.setJson(target == kStandardOutput);
}

Result<void> writeJson(cli::Console& console, const std::string& target, const nlohmann::json& document) {
    if (target.empty()) return {};
    if (target != kStandardOutput) return writeText(target, cli::dump(document) + "\n");
    console.document(document);
    return {};
}

namespace {

std::string processorName() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        if (line.rfind("model name", 0) != 0) continue;
        const std::size_t start = line.find_first_not_of(": \t", line.find(':'));
        if (start != std::string::npos) return line.substr(start);
    }
    return "unknown processor";
}

std::string today() {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    std::array<char, 16> text{};
    if (gmtime_r(&now, &utc) == nullptr) return "unknown date";
    std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc);
    return text.data();
}

constexpr bool kOptimised =
#ifdef __OPTIMIZE__
    true;
#else
    false;
#endif

#ifdef __clang__
constexpr const char* kCompiler = "clang " __clang_version__;
#else
constexpr const char* kCompiler = "g++ " __VERSION__;
#endif

}  // namespace

Environment environment() {
    Environment found;
    found.date = today();
    found.processor = processorName();
    found.cores = cli::defaultThreads();
    found.compiler = kCompiler;
    found.buildType = SHAPEDB_BUILD_TYPE;
    found.version = SHAPEDB_VERSION;
    found.optimised = kOptimised;
    return found;
}

std::string describe(const Environment& environment) {
    return environment.date + ", " + environment.processor + ", " +
           cli::formatCount(environment.cores, "core", "cores") + ", " + environment.compiler + ", " +
           environment.buildType + ", ShapeDB " + environment.version;
}

nlohmann::json environmentJson(const Environment& environment) {
    return {{"date", environment.date},
            {"processor", environment.processor},
            {"cores", environment.cores},
            {"compiler", environment.compiler},
            {"build_type", environment.buildType},
            {"optimised", environment.optimised},
            {"version", environment.version}};
}

}  // namespace shapedb::bench
