// What a key may be: one rule for uploads, for what is looked up, and for databases that are restored or
// checked.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace shapedb::store {

constexpr std::size_t kMaxKeyBytes = 512;

/// Why `key` is none, as "512 bytes, at most ..."; nothing if it is one: 1 to kMaxKeyBytes bytes of UTF-8
/// without characters that change what a terminal shows, or hide in it (findUnsafe in common/safe_text.h).
[[nodiscard]] std::optional<std::string> problemOfKey(const std::string& key);

}  // namespace shapedb::store
