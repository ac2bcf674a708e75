// Checks of flag values with readable messages: CLI11's own print the limits of a double in full.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace shapedb::cli {

/// A finite number of at least 0.
[[nodiscard]] inline CLI::Validator atLeastZero() {
    return {[](const std::string& text) {
                double value = 0.0;
                const bool good = CLI::detail::lexical_cast(text, value) && value >= 0.0 && value <= 1e300;
                return good ? std::string() : "'" + text + "' must be a number, 0 or greater";
            },
            ">=0", "at least zero"};
}

/// A finite number above 0.
[[nodiscard]] inline CLI::Validator aboveZero() {
    return {[](const std::string& text) {
                double value = 0.0;
                const bool good = CLI::detail::lexical_cast(text, value) && value > 0.0 && value <= 1e300;
                return good ? std::string() : "'" + text + "' must be a number greater than 0";
            },
            ">0", "above zero"};
}

}  // namespace shapedb::cli
