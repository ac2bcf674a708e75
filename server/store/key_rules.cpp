// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/key_rules.h"

#include <algorithm>

#include "common/safe_text.h"

namespace shapedb::store {
namespace {

bool isAlphanumeric(char c) noexcept {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

std::string tooLong(std::size_t bytes, std::size_t most) {
    return std::to_string(bytes) + " bytes, at most " + std::to_string(most) + " are allowed";
}

std::optional<std::string> problemOfText(const std::string& text, std::size_t most) {
    if (text.size() > most) return tooLong(text.size(), most);
    if (!isUtf8(text)) return "not valid UTF-8";
    return std::nullopt;
}

}  // namespace

std::optional<std::string> problemOfKey(const std::string& key) {
    if (key.empty()) return "a shape needs a key of 1 to " + std::to_string(kMaxKeyBytes) + " bytes";
    if (auto problem = problemOfText(key, kMaxKeyBytes)) return problem;
    const std::size_t at = findUnsafe(key);
    if (at == std::string::npos) return std::nullopt;
    return "control or invisible character at byte " + std::to_string(at);
}

bool isNameByte(char c) noexcept { return isAlphanumeric(c) || c == '_' || c == '.' || c == '-'; }

std::optional<std::string> problemOfCollectionName(const std::string& name) {
    if (name.empty()) return "a collection needs a name";
    if (name.size() > kMaxCollectionNameBytes) return tooLong(name.size(), kMaxCollectionNameBytes);
    if (std::all_of(name.begin(), name.end(), isNameByte) && isAlphanumeric(name.front()))
        return std::nullopt;
    return "only letters, digits, '_', '.' and '-' are allowed, the first a letter or digit";
}

std::optional<std::string> problemOfDescription(const std::string& description) {
    return problemOfText(description, kMaxDescriptionBytes);
}

std::optional<std::string> problemOfMetadataKey(const std::string& key) {
    const bool isKey =
        !key.empty() && key.size() <= kMaxMetadataKeyBytes && std::all_of(key.begin(), key.end(), isNameByte);
    if (isKey) return std::nullopt;
    return "not 1 to " + std::to_string(kMaxMetadataKeyBytes) + " letters, digits, '_', '.' and '-'";
}

std::optional<std::string> problemOfMetadataValue(const std::string& value) {
    return problemOfText(value, kMaxMetadataValueBytes);
}

}  // namespace shapedb::store
