#include "server/catalog/request_checks.h"

#include <algorithm>

#include "server/catalog/limits.h"

namespace shapedb::catalog {
namespace {

tl::unexpected<Error> bad(std::string message) {
    return fail(ErrorCode::kInvalidArgument, std::move(message));
}

bool isAlphanumeric(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool isNameByte(char c) { return isAlphanumeric(c) || c == '_' || c == '.' || c == '-'; }

/// Length in bytes of the UTF-8 character at `at`; 0 when it is invalid.
std::size_t characterLength(const std::string& text, std::size_t at) noexcept {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(at);
    if (first < 0x80) return 1;
    std::size_t length = 0;
    std::uint32_t code = 0;
    std::uint32_t smallest = 0;
    if ((first & 0xe0) == 0xc0) {
        length = 2, code = first & 0x1fu, smallest = 0x80;
    } else if ((first & 0xf0) == 0xe0) {
        length = 3, code = first & 0x0fu, smallest = 0x800;
    } else if ((first & 0xf8) == 0xf0) {
        length = 4, code = first & 0x07u, smallest = 0x10000;
    }
    if (length == 0 || at + length > text.size()) return 0;
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xc0) != 0x80) return 0;
        code = (code << 6) | (byte(at + i) & 0x3fu);
    }
    const bool surrogate = code >= 0xd800 && code <= 0xdfff;
    // Overlong forms would give one key several spellings.
    return code < smallest || surrogate || code > 0x10ffff ? 0 : length;
}

}  // namespace

bool isUtf8(const std::string& text) noexcept {
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = characterLength(text, i);
        if (length == 0) return false;
        i += length;
    }
    return true;
}

std::string collectionNameOrDefault(const std::string& name) {
    return name.empty() ? kDefaultCollection : name;
}

Result<void> checkCollectionName(const std::string& name) {
    if (name.empty()) return bad("name: a collection needs a name");
    if (name.size() > kMaxCollectionNameBytes) {
        return bad("name: " + std::to_string(name.size()) + " bytes, at most " +
                   std::to_string(kMaxCollectionNameBytes) + " are allowed");
    }
    if (!std::all_of(name.begin(), name.end(), isNameByte) || !isAlphanumeric(name.front())) {
        return bad("name: only letters, digits, '_', '.' and '-' are allowed, the first a letter or digit");
    }
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
    if (key.empty())
        return bad("key: a shape needs a key of 1 to " + std::to_string(kMaxKeyBytes) + " bytes");
    if (key.size() > kMaxKeyBytes) {
        return bad("key: " + std::to_string(key.size()) + " bytes, at most " + std::to_string(kMaxKeyBytes) +
                   " are allowed");
    }
    const auto isControl = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
    const auto control = std::find_if(key.begin(), key.end(), isControl);
    if (control != key.end()) {
        return bad("key: control character at byte " + std::to_string(control - key.begin()));
    }
    if (!isUtf8(key)) return bad("key: not valid UTF-8");
    return {};
}

Result<void> checkMetadata(const Metadata& metadata) {
    if (metadata.size() > kMaxMetadataEntries) {
        return bad("metadata: " + std::to_string(metadata.size()) + " entries, at most " +
                   std::to_string(kMaxMetadataEntries) + " are allowed");
    }
    for (const auto& [key, value] : metadata) {
        if (key.empty() || key.size() > kMaxMetadataKeyBytes ||
            !std::all_of(key.begin(), key.end(), isNameByte)) {
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
