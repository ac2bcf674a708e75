// SPDX-License-Identifier: Apache-2.0
#include "common/utc_text.h"

#include <array>

namespace shapedb {

std::string utcText(std::time_t seconds, const char* format) {
    std::tm parts{};
    if (gmtime_r(&seconds, &parts) == nullptr) return {};
    std::array<char, 64> text{};
    return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

}  // namespace shapedb
