// SPDX-License-Identifier: GPL-3.0-or-later
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

/// More noise than this share of the diagonal leaves no shape: a percentage was meant.
constexpr double kMostNoise = 0.2;

/// A share of the diagonal.
[[nodiscard]] inline CLI::Validator noiseShare() {
    return {
        [](const std::string& text) {
            double value = 0.0;
            const bool good = CLI::detail::lexical_cast(text, value) && value >= 0.0 && value <= kMostNoise;
            return good ? std::string()
                        : "'" + text + "' must be a share of the diagonal, 0 to 0.2: 0.005 is half a percent";
        },
        "0 to 0.2", "share of the diagonal"};
}

/// An empty one is what a script with an unset variable gives, not a flag left out.
[[nodiscard]] inline CLI::Validator notEmpty() {
    return {[](const std::string& text) { return text.empty() ? std::string("is empty") : std::string(); },
            "", "not empty"};
}

/// A file to write that is named as what it will be, e.g. ".ply". A name without an ending will do: devices
/// have none.
[[nodiscard]] inline CLI::Validator endsIn(const std::string& ending) {
    return {[ending](const std::string& text) {
                std::string own = text.substr(text.find_last_of('/') + 1);
                own = own.find('.') == std::string::npos ? ending : own.substr(own.rfind('.'));
                own = CLI::detail::to_lower(own);
                return own == ending ? std::string()
                                     : "'" + text + "' cannot be written: only " + ending + " files can";
            },
            "", "ending"};
}

}  // namespace shapedb::cli
