// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/output.h"

#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

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

}  // namespace shapedb::bench
