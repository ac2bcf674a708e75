// Checks of the fields of a request, whatever its transport. Each error names the field, what is
// wrong with it and what is allowed.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/error.h"
#include "core/base/metadata.h"
#include "core/search/verify.h"

namespace shapedb::catalog {

constexpr const char* kDefaultCollection = "default";

/// "default" for an empty name.
[[nodiscard]] std::string collectionNameOrDefault(const std::string& name);

/// 1 to kMaxCollectionNameBytes of [A-Za-z0-9_.-], starting with a letter or digit.
[[nodiscard]] Result<void> checkCollectionName(const std::string& name);
/// At most kMaxDescriptionBytes.
[[nodiscard]] Result<void> checkDescription(const std::string& description);
/// 1 to kMaxKeyBytes of UTF-8 without control characters.
[[nodiscard]] Result<void> checkKey(const std::string& key);
/// At most kMaxMetadataEntries, each key and value within its limits.
[[nodiscard]] Result<void> checkMetadata(const Metadata& metadata);
/// 1 to `maxK`.
[[nodiscard]] Result<void> checkK(std::uint32_t k, std::uint32_t maxK);
/// 1 to `maxBatch` queries.
[[nodiscard]] Result<void> checkBatchSize(std::uint64_t queries, std::uint32_t maxBatch);
/// At most kMostVerified candidates; a viewpoint is finite and not of a query that is not of one side.
[[nodiscard]] Result<void> checkVerifyOptions(const VerifyOptions& options);
/// [0, 1], not NaN.
[[nodiscard]] Result<void> checkThreshold(double threshold);
/// At most kMaxFilterBytes.
[[nodiscard]] Result<void> checkFilterLength(const std::string& filter);
/// 0 (the default) to kMaxPageSize.
[[nodiscard]] Result<void> checkPageSize(std::uint32_t pageSize);

}  // namespace shapedb::catalog
