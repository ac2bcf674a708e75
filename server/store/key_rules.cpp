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

}  // namespace

std::optional<std::string> problemOfKey(const std::string& key) {
    if (key.empty()) return "a shape needs a key of 1 to " + std::to_string(kMaxKeyBytes) + " bytes";
    if (key.size() > kMaxKeyBytes) return tooLong(key.size(), kMaxKeyBytes);
    if (!isUtf8(key)) return "not valid UTF-8";
    const std::size_t at = findUnsafe(key);
    if (at == std::string::npos) return std::nullopt;
    return "control character at byte " + std::to_string(at);
}

bool isNameByte(char c) noexcept { return isAlphanumeric(c) || c == '_' || c == '.' || c == '-'; }

std::optional<std::string> problemOfCollectionName(const std::string& name) {
    if (name.empty()) return "a collection needs a name";
    if (name.size() > kMaxCollectionNameBytes) return tooLong(name.size(), kMaxCollectionNameBytes);
    if (std::all_of(name.begin(), name.end(), isNameByte) && isAlphanumeric(name.front()))
        return std::nullopt;
    return "only letters, digits, '_', '.' and '-' are allowed, the first a letter or digit";
}

}  // namespace shapedb::store
