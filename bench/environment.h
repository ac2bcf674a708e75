// Where and how figures were measured: without it a time is worth nothing.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace shapedb::bench {

struct Environment {
    std::string date;       ///< of today, UTC, as 2026-01-31
    std::string processor;  ///< model name; "unknown processor" when the system does not tell
    unsigned cores = 1;     ///< that this program may use
    std::string compiler;
    std::string buildType;  ///< of CMake, e.g. "Release"
    std::string version;    ///< of ShapeDB
    bool optimised = true;  ///< false: times mean nothing
};

[[nodiscard]] Environment environment();

/// One line: "2026-01-31, AMD EPYC ..., 2 cores, g++ 12.2.0, Release, ShapeDB 0.1.0".
[[nodiscard]] std::string describe(const Environment& environment);

/// The same with a name for each.
[[nodiscard]] nlohmann::json environmentJson(const Environment& environment);

}  // namespace shapedb::bench
