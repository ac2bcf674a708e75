// SPDX-License-Identifier: GPL-3.0-or-later
// Checks of the fields of a request, whatever its transport. Each error names the field, what is
// wrong with it and what is allowed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/metadata.h"
#include "core/geometry/point.h"
#include "core/search/verify.h"
#include "server/store/metadata_change.h"

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
/// As `checkMetadata` of what it sets; removes at most kMaxMetadataEntries keys; nothing is both set and
/// removed, or removed where all is replaced.
[[nodiscard]] Result<void> checkMetadataChange(const store::MetadataChange& change);
/// 1 to kMaxMetadataKeyBytes of [A-Za-z0-9_.-]. `field` names it in the error.
[[nodiscard]] Result<void> checkMetadataKey(const char* field, const std::string& key);
/// 1 to kMaxKeys, each as `checkKey`.
[[nodiscard]] Result<void> checkKeys(const std::vector<std::string>& keys);
/// At most kMaxKeyBytes of UTF-8.
[[nodiscard]] Result<void> checkKeyPrefix(const std::string& prefix);
/// 0 (the default) to kMaxValues.
[[nodiscard]] Result<void> checkMaxValues(std::uint32_t maxValues);
/// A version; 0: the key is free.
[[nodiscard]] Result<void> checkExpectedVersion(const std::optional<std::int64_t>& version);
/// 1 to `maxK`.
[[nodiscard]] Result<void> checkK(std::uint32_t k, std::uint32_t maxK);
/// 1 to `maxBatch` queries.
[[nodiscard]] Result<void> checkBatchSize(std::uint64_t queries, std::uint32_t maxBatch);
/// At most kMostVerified candidates; a viewpoint is finite and not of a query that is not of one side.
[[nodiscard]] Result<void> checkVerifyOptions(const VerifyOptions& options);
/// No groups, or by a key as `checkMetadataKey` with 0 (the default) to kMaxPerGroup hits of each, in all not
/// more than `maxK`.
[[nodiscard]] Result<void> checkGrouping(const std::string& groupBy, std::uint32_t perGroup, std::uint32_t k,
                                         std::uint32_t maxK);
/// The origin of points: finite, no coordinate beyond kMaxCoordinate. Errors: kNonFiniteCoordinate,
/// kCoordinateOutOfRange.
[[nodiscard]] Result<void> checkOrigin(const Point3& origin);
/// [0, 1], not NaN.
[[nodiscard]] Result<void> checkThreshold(double threshold);
/// At most kMaxFilterBytes.
[[nodiscard]] Result<void> checkFilterLength(const std::string& filter);
/// 0 (the default) to kMaxPageSize.
[[nodiscard]] Result<void> checkPageSize(std::uint32_t pageSize);

}  // namespace shapedb::catalog
