#include "server/catalog/request_checks.h"

#include <algorithm>

#include "common/safe_text.h"
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
    if (description.size() > kMaxDescriptionBytes) {
        return bad("description: " + std::to_string(description.size()) + " bytes, at most " +
                   std::to_string(kMaxDescriptionBytes) + " are allowed");
    }
    return {};
}

Result<void> checkKey(const std::string& key) {
    if (const auto problem = store::problemOfKey(key)) return bad("key: " + *problem);
    return {};
}

Result<void> checkMetadata(const Metadata& metadata) {
    if (metadata.size() > kMaxMetadataEntries) {
        return bad("metadata: " + std::to_string(metadata.size()) + " entries, at most " +
                   std::to_string(kMaxMetadataEntries) + " are allowed");
    }
    for (const auto& [key, value] : metadata) {
        if (key.empty() || key.size() > kMaxMetadataKeyBytes ||
            !std::all_of(key.begin(), key.end(), store::isNameByte)) {
            return bad("metadata: key '" + key.substr(0, kMaxMetadataKeyBytes) + "' is not 1 to " +
                       std::to_string(kMaxMetadataKeyBytes) + " letters, digits, '_', '.' and '-'");
        }
        if (value.size() > kMaxMetadataValueBytes) {
            return bad("metadata: the value of '" + key + "' has " + std::to_string(value.size()) +
                       " bytes, at most " + std::to_string(kMaxMetadataValueBytes) + " are allowed");
        }
        if (!isUtf8(value)) return bad("metadata: the value of '" + key + "' is not valid UTF-8");
    }
    return {};
}

Result<void> checkK(std::uint32_t k, std::uint32_t maxK) {
    if (k >= 1 && k <= maxK) return {};
    return bad("k: " + std::to_string(k) + " is outside 1 to " + std::to_string(maxK));
}

Result<void> checkBatchSize(std::uint64_t queries, std::uint32_t maxBatch) {
    if (queries >= 1 && queries <= maxBatch) return {};
    return bad("queries: " + std::to_string(queries) + " is outside 1 to " + std::to_string(maxBatch));
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

Result<void> checkThreshold(double threshold) {
    if (threshold >= 0.0 && threshold <= 1.0) return {};
    return bad("threshold: " + std::to_string(threshold) + " is outside 0 to 1");
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
