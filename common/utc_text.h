// SPDX-License-Identifier: Apache-2.0
// Points in time, for people and JSON.
#pragma once

#include <array>
#include <ctime>
#include <string>

namespace shapedb {

/// `format` as strftime, of at most 63 characters when written; in UTC. Empty for a year that does not fit.
[[nodiscard]] inline std::string utcText(std::time_t seconds, const char* format) {
    std::tm parts{};
    if (gmtime_r(&seconds, &parts) == nullptr) return {};
    std::array<char, 64> text{};
    return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

}  // namespace shapedb
