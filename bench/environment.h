// SPDX-License-Identifier: GPL-3.0-or-later
// Where and how figures were measured.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace shapedb::bench {

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
