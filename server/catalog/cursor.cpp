#include "server/catalog/cursor.h"

#include <charconv>

#include "common/sha256.h"

namespace shapedb::catalog {
namespace {

// "1" (version), 16 digits of the id, 16 digits of the checksum.
constexpr char kVersion = '1';
constexpr std::size_t kDigits = 16;
constexpr std::size_t kLength = 1 + 2 * kDigits;

std::string hex16(std::uint64_t value) {
    constexpr char kHex[] = "0123456789abcdef";
    std::string text(kDigits, '0');
    for (std::size_t i = 0; i < kDigits; ++i) text[kDigits - 1 - i] = kHex[(value >> (4 * i)) & 0xf];
    return text;
}

/// Of everything the cursor depends on. Unambiguous: only the last part has a variable length.
std::string checksum(const Listing& listing, const std::string& id) {
    const std::string bound = std::string("shapedb cursor ") + kVersion + ' ' + id + ' ' +
                              hex16(static_cast<std::uint64_t>(listing.collectionId)) + ' ' +
                              std::to_string(listing.state) + ' ' + listing.filter;
    return toHex(sha256(bound.data(), bound.size())).substr(0, kDigits);
}

}  // namespace

std::string encodeCursor(const Listing& listing, std::int64_t afterId) {
    const std::string id = hex16(static_cast<std::uint64_t>(afterId));
    return kVersion + id + checksum(listing, id);
}

Result<std::int64_t> decodeCursor(const Listing& listing, const std::string& cursor) {
    if (cursor.empty()) return 0;
    const auto malformed = [](const char* what) {
        return fail(ErrorCode::kMalformedCursor,
                    std::string("cursor: ") + what +
                        ": pass next_cursor of the page before unchanged, with the "
                        "same collection, filter and state, or start without one");
    };
    if (cursor.size() != kLength) return malformed("damaged");
    if (cursor.front() != kVersion) return malformed("of another version of the server");
    const std::string id = cursor.substr(1, kDigits);
    if (cursor.substr(1 + kDigits) != checksum(listing, id))
        return malformed("damaged or of another listing");
    std::uint64_t afterId = 0;
    const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), afterId, 16);
    if (error != std::errc() || end != id.data() + id.size()) return malformed("damaged");
    return static_cast<std::int64_t>(afterId);
}

}  // namespace shapedb::catalog
