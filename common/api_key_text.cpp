// SPDX-License-Identifier: Apache-2.0
#include "common/api_key_text.h"

#include <cctype>

namespace shapedb {

namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

std::size_t hexDigits(std::string_view text) {
    std::size_t count = 0;
    while (count < text.size() && std::isxdigit(static_cast<unsigned char>(text[count])) != 0) ++count;
    return count;
}

/// Bytes of "shapedb_ID_" if `text` begins with that, and a secret follows; otherwise 0.
std::size_t publicPart(std::string_view text) {
    constexpr std::size_t kBytes = kApiKeyPrefix.size() + kApiKeyIdDigits + 1;
    if (text.size() <= kBytes || text[kBytes - 1] != '_') return 0;
    for (std::size_t i = 0; i < kApiKeyPrefix.size(); ++i) {
        if (lower(text[i]) != kApiKeyPrefix[i]) return 0;
    }
    const bool id = hexDigits(text.substr(kApiKeyPrefix.size(), kApiKeyIdDigits)) == kApiKeyIdDigits;
    return id && hexDigits(text.substr(kBytes, 1)) == 1 ? kBytes : 0;
}

}  // namespace

std::string maskSecrets(std::string_view text) {
    std::string masked;
    masked.reserve(text.size());
    while (!text.empty()) {
        const std::size_t shown = lower(text.front()) == kApiKeyPrefix.front() ? publicPart(text) : 0;
        if (shown == 0) {
            masked += text.front();
            text.remove_prefix(1);
            continue;
        }
        masked.append(text.substr(0, shown)).append("***");
        text.remove_prefix(shown);
        text.remove_prefix(hexDigits(text));
    }
    return masked;
}

}  // namespace shapedb
