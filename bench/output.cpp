#include "bench/output.h"

#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "client/io/output_file.h"

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
    if (!file) return fail(file.error());
    if (const auto written = file->write(text); !written) return written;
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

}  // namespace shapedb::bench
