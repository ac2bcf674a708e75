#include "server/store/key_rules.h"

#include "common/safe_text.h"

namespace shapedb::store {

std::optional<std::string> problemOfKey(const std::string& key) {
    if (key.empty()) return "a shape needs a key of 1 to " + std::to_string(kMaxKeyBytes) + " bytes";
    if (key.size() > kMaxKeyBytes) {
        return std::to_string(key.size()) + " bytes, at most " + std::to_string(kMaxKeyBytes) +
               " are allowed";
    }
    if (!isUtf8(key)) return "not valid UTF-8";
    const std::size_t at = findUnsafe(key);
    if (at == std::string::npos) return std::nullopt;
    return "control character at byte " + std::to_string(at);
}

}  // namespace shapedb::store
