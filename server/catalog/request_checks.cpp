// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/request_checks.h"

#include <cmath>

#include "common/safe_text.h"
#include "core/base/number_text.h"
#include "core/base/return_if_error.h"
#include "core/preparation/frame.h"
#include "server/catalog/limits.h"
#include "server/store/key_rules.h"

namespace shapedb::catalog {
namespace {

tl::unexpected<Error> bad(std::string message) {
    return fail(ErrorCode::kInvalidArgument, std::move(message));
}

}  // namespace

std::string collectionNameOrDefault(const std::string& name) {
    return name.empty() ? kDefaultCollection : name;
}

Result<void> checkCollectionName(const std::string& name) {
    if (const auto problem = store::problemOfCollectionName(name)) return bad("name: " + *problem);
    return {};
}

Result<void> checkDescription(const std::string& description) {
    if (const auto problem = store::problemOfDescription(description)) return bad("description: " + *problem);
    return {};
}

Result<void> checkKey(const std::string& key) {
    if (const auto problem = store::problemOfKey(key)) return bad("key: " + *problem);
    return {};
}

Result<void> checkMetadataKey(const char* field, const std::string& key) {
    const auto problem = store::problemOfMetadataKey(key);
    if (!problem) return {};
    return bad(std::string(field) + " '" + key.substr(0, kMaxMetadataKeyBytes) + "' is " + *problem);
}

Result<void> checkMetadataChange(const store::MetadataChange& change) {
    RETURN_IF_ERROR(checkMetadata(change.set));
    if (change.replaceAll && !change.remove.empty()) {
        return bad("remove: replace_all removes all keys that are not set; leave one out");
    }
    if (change.remove.size() > kMaxMetadataEntries) {
        return bad("remove: " + std::to_string(change.remove.size()) + " keys, at most " +
                   std::to_string(kMaxMetadataEntries) + " are allowed");
    }
    for (const std::string& key : change.remove) {
        RETURN_IF_ERROR(checkMetadataKey("remove: key", key));
        if (change.set.count(key) > 0) return bad("remove: key '" + key + "' is also set");
    }
    return {};
}

Result<void> checkKeys(const std::vector<std::string>& keys) {
    if (keys.empty() || keys.size() > kMaxKeys) {
        return bad("keys: " + std::to_string(keys.size()) + " keys, 1 to " + std::to_string(kMaxKeys) +
                   " are allowed");
    }
    for (std::size_t i = 0; i < keys.size(); ++i) {
        if (const auto problem = store::problemOfKey(keys[i])) {
            return bad("keys: key " + std::to_string(i) + ": " + *problem);
        }
    }
    return {};
}

Result<void> checkKeyPrefix(const std::string& prefix) {
    if (prefix.size() > kMaxKeyBytes) {
        return bad("key_prefix: " + std::to_string(prefix.size()) + " bytes, at most " +
                   std::to_string(kMaxKeyBytes) + " are allowed");
    }
    if (!isUtf8(prefix)) return bad("key_prefix: not valid UTF-8");
    return {};
}

Result<void> checkMaxValues(std::uint32_t maxValues) {
    if (maxValues <= kMaxValues) return {};
    return bad("max_values: " + std::to_string(maxValues) + " is outside 1 to " + std::to_string(kMaxValues));
}

Result<void> checkExpectedVersion(const std::optional<std::int64_t>& version) {
    if (version.value_or(0) >= 0) return {};
    return bad("expected_version: must be 0 (the key is free) or more");
}

Result<void> checkMetadata(const Metadata& metadata) {
    if (metadata.size() > kMaxMetadataEntries) {
        return bad("metadata: " + std::to_string(metadata.size()) + " entries, at most " +
                   std::to_string(kMaxMetadataEntries) + " are allowed");
    }
    for (const auto& [key, value] : metadata) {
        RETURN_IF_ERROR(checkMetadataKey("metadata: key", key));
        if (const auto problem = store::problemOfMetadataValue(value)) {
            return bad("metadata: the value of '" + key + "': " + *problem);
        }
    }
    return {};
}

Result<void> checkK(std::uint32_t k, std::uint32_t maxK) {
    if (k >= 1 && k <= maxK) return {};
    return bad("k: " + std::to_string(k) + " is outside 1 to " + std::to_string(maxK) + " (limits.max_k)");
}

Result<void> checkBatchSize(std::uint64_t queries, std::uint32_t maxBatch) {
    if (queries >= 1 && queries <= maxBatch) return {};
    return bad("queries: " + std::to_string(queries) + " is outside 1 to " + std::to_string(maxBatch) +
               " (limits.max_batch)");
}

Result<void> checkVerifyOptions(const VerifyOptions& options) {
    if (options.mostCandidates > kMostVerified) {
        return bad("verify_candidates: " + std::to_string(options.mostCandidates) + " is more than " +
                   std::to_string(kMostVerified));
    }
    if (!options.viewpoint) return {};
    if (!isFinite(*options.viewpoint)) return bad("viewpoint: a coordinate is not finite");
    if (!options.oneSided.value_or(true)) return bad("viewpoint: given for a query that is not one-sided");
    return {};
}

Result<void> checkGrouping(const std::string& groupBy, std::uint32_t perGroup, std::uint32_t k,
                           std::uint32_t maxK) {
    if (groupBy.empty()) {
        if (perGroup == 0) return {};
        return bad("per_group: given without group_by");
    }
    RETURN_IF_ERROR(checkMetadataKey("group_by:", groupBy));
    if (perGroup > kMaxPerGroup) {
        return bad("per_group: " + std::to_string(perGroup) + " is outside 1 to " +
                   std::to_string(kMaxPerGroup));
    }
    if (std::uint64_t{k} * perGroup > maxK) {
        return bad("per_group: " + std::to_string(k) + " groups of " + std::to_string(perGroup) +
                   " are more than " + std::to_string(maxK) + " hits (limits.max_k)");
    }
    return {};
}

Result<void> checkOrigin(const Point3& origin) {
    const double coordinates[3] = {origin.x, origin.y, origin.z};
    for (int axis = 0; axis < 3; ++axis) {
        const double value = coordinates[axis];
        const std::string name = std::string("origin: ") + static_cast<char>('x' + axis);
        if (!std::isfinite(value)) {
            return fail(ErrorCode::kNonFiniteCoordinate,
                        name + (std::isnan(value) ? " is NaN" : " is infinite"));
        }
        if (std::abs(value) > kMaxCoordinate) {
            return fail(ErrorCode::kCoordinateOutOfRange, name + " exceeds the largest magnitude 3.4e38");
        }
    }
    return {};
}

Result<void> checkThreshold(double threshold) {
    if (threshold >= 0.0 && threshold <= 1.0) return {};
    return bad("threshold: " + numberText(threshold) + " is outside 0 to 1");
}

Result<void> checkFilterLength(const std::string& filter) {
    if (filter.size() <= kMaxFilterBytes) return {};
    return fail(ErrorCode::kMalformedFilter, "filter: " + std::to_string(filter.size()) + " bytes, at most " +
                                                 std::to_string(kMaxFilterBytes) + " are allowed");
}

Result<void> checkPageSize(std::uint32_t pageSize) {
    if (pageSize <= kMaxPageSize) return {};
    return bad("page_size: " + std::to_string(pageSize) + " is outside 1 to " + std::to_string(kMaxPageSize));
}

}  // namespace shapedb::catalog
