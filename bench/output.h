// SPDX-License-Identifier: GPL-3.0-or-later
// What operations write: results, and where and how they were measured.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "client/cli/console.h"
#include "core/base/error.h"

namespace shapedb::bench {

/// Writes `text` to `path`, replacing the file atomically.
/// Errors: kFileNotWritable.
[[nodiscard]] Result<void> writeText(const std::string& path, std::string_view text);

/// `value` by a printf format for one double, e.g. "%.2f"; at most 63 characters.
[[nodiscard]] std::string numberText(const char* format, double value);

/// --json FILE|-: to a file, or to standard output instead of the readable text. Empty: nowhere.
/// Call `announceJson` before anything is printed. Errors: kFileNotWritable.
void announceJson(cli::Console& console, const std::string& target);
[[nodiscard]] Result<void> writeJson(cli::Console& console, const std::string& target,
                                     const nlohmann::json& document);

struct Environment {
    std::string date;       ///< today, UTC, as 2026-01-31
    std::string processor;  ///< model name, or "unknown processor"
    unsigned cores = 1;     ///< that this program may use
    std::string compiler;
    std::string buildType;  ///< of CMake, e.g. "Release"
    std::string version;    ///< of ShapeDB
    bool optimised = true;  ///< false: times are meaningless
};

[[nodiscard]] Environment environment();

/// One line: "2026-01-31, AMD EPYC ..., 2 cores, g++ 12.2.0, Release, ShapeDB 0.1.0".
[[nodiscard]] std::string describe(const Environment& environment);

/// The same as named values.
[[nodiscard]] nlohmann::json environmentJson(const Environment& environment);

}  // namespace shapedb::bench
