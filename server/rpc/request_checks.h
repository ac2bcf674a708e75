// Checks of what a request says, before anything is done. Each error names the field, what is
// wrong with it and what would be right.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/base/error.h"
#include "server/config/server_config.h"

namespace shapedb::rpc {

constexpr const char* kDefaultCollection = "default";

/// "default" for an empty name.
[[nodiscard]] std::string collectionNameOrDefault(const std::string& name);

/// 1 to kMaxCollectionNameBytes of [A-Za-z0-9_.-], starting with a letter or digit.
[[nodiscard]] Result<void> checkCollectionName(const std::string& name);
/// At most kMaxDescriptionBytes.
[[nodiscard]] Result<void> checkDescription(const std::string& description);
/// 1 to kMaxKeyBytes of UTF-8 without control characters.
[[nodiscard]] Result<void> checkKey(const std::string& key);
/// kMaxMetadataEntries, and the limits of each key and value.
[[nodiscard]] Result<void> checkMetadata(const std::map<std::string, std::string>& metadata);
/// 1 to config.limits.maxK. The message names the limit.
[[nodiscard]] Result<void> checkK(std::uint32_t k, const config::ServerConfig& config);
/// [0, 1], not NaN.
[[nodiscard]] Result<void> checkThreshold(double threshold);
/// At most kMaxFilterBytes.
[[nodiscard]] Result<void> checkFilterLength(const std::string& filter);
/// 0 (the default) to kMaxPageSize.
[[nodiscard]] Result<void> checkPageSize(std::uint32_t pageSize);

/// Valid UTF-8: no overlong forms, surrogates or code points past U+10FFFF.
[[nodiscard]] bool isUtf8(const std::string& text) noexcept;

}  // namespace shapedb::rpc
