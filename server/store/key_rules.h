// SPDX-License-Identifier: GPL-3.0-or-later
// What the keys and metadata of shapes and the names of collections may be: one rule for uploads, for what is
// looked up, for databases that are restored or checked, and for what an API key may use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace shapedb::store {

/// The last millisecond of the year 9999, beyond which clients know no time. Since 1970.
constexpr std::int64_t kLastMoment = 253'402'300'799'999;

constexpr std::size_t kMaxKeyBytes = 512;
constexpr std::size_t kMaxCollectionNameBytes = 128;
constexpr std::size_t kMaxDescriptionBytes = 1'024;
constexpr std::size_t kMaxMetadataEntries = 64;
constexpr std::size_t kMaxMetadataKeyBytes = 128;
constexpr std::size_t kMaxMetadataValueBytes = 1'024;

/// Why `key` is none, as "512 bytes, at most ..."; nothing if it is one: 1 to kMaxKeyBytes bytes of UTF-8
/// without characters that change what a terminal shows, or hide in it (findUnsafe in common/safe_text.h).
[[nodiscard]] std::optional<std::string> problemOfKey(const std::string& key);

/// A letter, a digit, '_', '.' or '-'.
[[nodiscard]] bool isNameByte(char c) noexcept;

/// The same for the name of a collection: 1 to kMaxCollectionNameBytes of the above, the first a letter or
/// digit.
[[nodiscard]] std::optional<std::string> problemOfCollectionName(const std::string& name);

/// Of a collection: at most kMaxDescriptionBytes of UTF-8.
[[nodiscard]] std::optional<std::string> problemOfDescription(const std::string& description);

/// 1 to kMaxMetadataKeyBytes, each as isNameByte.
[[nodiscard]] std::optional<std::string> problemOfMetadataKey(const std::string& key);

/// At most kMaxMetadataValueBytes of UTF-8.
[[nodiscard]] std::optional<std::string> problemOfMetadataValue(const std::string& value);

}  // namespace shapedb::store
