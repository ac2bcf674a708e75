// SPDX-License-Identifier: Apache-2.0
// Numbers in messages and files, as a person would type them.
#pragma once

#include <charconv>
#include <string>

namespace shapedb {

/// The shortest text that reads back as the same number: "2", "0.1", "-2.5e-07"; std::to_string would say
/// "2.000000".
[[nodiscard]] inline std::string numberText(double value) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value == 0.0 ? 0.0 : value);
    return {buffer, end.ptr};
}

}  // namespace shapedb
