// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/cursor.h"

#include <charconv>

#include "common/sha256.h"

namespace shapedb::catalog {
namespace {

// "2" (version), the place in hexadecimal digits, 16 digits of the checksum.
constexpr char kVersion = '2';
constexpr std::size_t kDigits = 16;

std::string hex16(std::uint64_t value) {
    constexpr char kHex[] = "0123456789abcdef";
    std::string text(kDigits, '0');
    for (std::size_t i = 0; i < kDigits; ++i) text[kDigits - 1 - i] = kHex[(value >> (4 * i)) & 0xf];
    return text;
}

/// Of everything the cursor depends on. Unambiguous: what has a variable length follows its length.
std::string checksum(const Listing& listing, const std::string& place) {
    std::string bound = std::string("shapedb cursor ") + kVersion;
    for (const std::uint64_t number :
         {static_cast<std::uint64_t>(listing.collectionId), static_cast<std::uint64_t>(listing.state),
          static_cast<std::uint64_t>(listing.order), std::uint64_t{listing.descending}}) {
        bound += ' ' + std::to_string(number);
    }
    for (const std::string* text : {&place, &listing.filter, &listing.keyPrefix}) {
        bound += ' ' + std::to_string(text->size()) + ' ' + *text;
    }
    return toHex(sha256(bound.data(), bound.size())).substr(0, kDigits);
}

std::string placeText(store::ShapeOrder order, const store::ShapeListing::Place& place) {
    const std::string id = hex16(static_cast<std::uint64_t>(place.id));
    switch (order) {
        case store::ShapeOrder::kId: break;
        case store::ShapeOrder::kUpdated: return id + hex16(static_cast<std::uint64_t>(place.updatedAt));
        case store::ShapeOrder::kKey: {
            std::string text = id;
            for (const char byte : place.key) text += hex16(static_cast<unsigned char>(byte)).substr(14);
            return text;
        }
    }
    return id;
}

/// False unless all of `digits` is one number.
bool readHex(const std::string& digits, std::uint64_t& value) {
    const char* end = digits.data() + digits.size();
    const auto [at, error] = std::from_chars(digits.data(), end, value, 16);
    return error == std::errc() && at == end;
}

std::optional<store::ShapeListing::Place> readPlace(store::ShapeOrder order, const std::string& text) {
    std::uint64_t number = 0;
    store::ShapeListing::Place place;
    if (text.size() < kDigits || !readHex(text.substr(0, kDigits), number)) return std::nullopt;
    place.id = static_cast<std::int64_t>(number);
    const std::string rest = text.substr(kDigits);
    switch (order) {
        case store::ShapeOrder::kId: break;
        case store::ShapeOrder::kUpdated:
            if (rest.size() != kDigits || !readHex(rest, number)) return std::nullopt;
            place.updatedAt = static_cast<store::TimestampMs>(number);
            return place;
        case store::ShapeOrder::kKey:
            if (rest.size() % 2 != 0) return std::nullopt;
            for (std::size_t i = 0; i < rest.size(); i += 2) {
                if (!readHex(rest.substr(i, 2), number)) return std::nullopt;
                place.key += static_cast<char>(number);
            }
            return place;
    }
    return rest.empty() ? std::optional(place) : std::nullopt;
}

}  // namespace

std::string encodeCursor(const Listing& listing, const store::ShapeListing::Place& after) {
    const std::string place = placeText(listing.order, after);
    return kVersion + place + checksum(listing, place);
}

Result<std::optional<store::ShapeListing::Place>> decodeCursor(const Listing& listing,
                                                               const std::string& cursor) {
    if (cursor.empty()) return std::optional<store::ShapeListing::Place>();
    const auto malformed = [](const char* what) {
        return fail(ErrorCode::kMalformedCursor,
                    std::string("cursor: ") + what +
                        ": pass next_cursor of the page before unchanged, with the same collection, filter, "
                        "state, order and prefix, or start without one");
    };
    if (cursor.size() < 1 + kDigits) return malformed("damaged");
    if (cursor.front() != kVersion) return malformed("of another version of the server");
    const std::string place = cursor.substr(1, cursor.size() - 1 - kDigits);
    if (cursor.substr(cursor.size() - kDigits) != checksum(listing, place)) {
        return malformed("damaged or of another listing");
    }
    auto read = readPlace(listing.order, place);
    if (!read) return malformed("damaged");
    return read;
}

}  // namespace shapedb::catalog
