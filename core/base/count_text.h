// SPDX-License-Identifier: Apache-2.0
// Counts in sentences.
#pragma once

#include <cstdint>
#include <string>

namespace shapedb {

/// "1 point", "3 points"; "1 vertex", "3 vertices".
inline std::string countText(std::uint64_t count, const std::string& singular, const std::string& plural) {
    return std::to_string(count) + " " + (count == 1 ? singular : plural);
}
inline std::string countText(std::uint64_t count, const std::string& singular) {
    return countText(count, singular, singular + "s");
}

}  // namespace shapedb
