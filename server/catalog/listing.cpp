// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/listing.h"

#include <algorithm>
#include <charconv>
#include <unordered_map>
#include <utility>

#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "core/search/filter.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"

namespace shapedb::catalog {

Result<store::ShapeFilter> makeFilter(const ShapeSelection& selection, const RunContext& context) {
    RETURN_IF_ERROR(checkFilterLength(selection.filter));
    RETURN_IF_ERROR(checkKeyPrefix(selection.keyPrefix));
    Result<Filter> filter = Filter::parse(selection.filter);
    RETURN_IF_ERROR(filter);
    store::ShapeFilter result;
    result.state = selection.state;
    result.context = context;
    result.keyPrefix = selection.keyPrefix;
    // With no `accept` the store counts without reading rows.
    if (filter->acceptsAll()) return result;
    result.accept = [filter = std::move(*filter)](const store::Shape& shape) {
        return filter.matches(shape.metadata, shape.key);
    };
    return result;
}

namespace {

/// What a cursor is bound to: 0 for all states.
int cursorState(const std::optional<store::ShapeState>& state) {
    return state ? 1 + static_cast<int>(*state) : 0;
}

}  // namespace

Result<std::string> listPage(
    Catalog& catalog, const index::Snapshot& collection, const ListRequest& request,
    const RunContext& context,
    const std::function<std::size_t(const store::Shape&, std::optional<double> quality)>& visit) {
    RETURN_IF_ERROR(checkPageSize(request.pageSize));
    const auto filter = makeFilter(request.selection, context);
    RETURN_IF_ERROR(filter);
    Listing listing;
    listing.collectionId = collection.collection.id;
    listing.filter = request.selection.filter;
    listing.state = cursorState(request.selection.state);
    listing.keyPrefix = request.selection.keyPrefix;
    listing.order = request.order;
    listing.descending = request.descending;
    auto after = decodeCursor(listing, request.cursor);
    RETURN_IF_ERROR(after);

    const std::size_t pageSize = request.pageSize == 0 ? kDefaultPageSize : request.pageSize;
    // One more than requested tells whether there is a next page.
    const auto shapes = catalog.listShapes(
        listing.collectionId, {request.order, request.descending, std::move(*after)}, pageSize + 1, *filter);
    RETURN_IF_ERROR(shapes);
    std::vector<std::int64_t> ids;
    for (const store::Shape& shape : *shapes) ids.push_back(shape.id);
    const auto qualities = catalog.qualities(collection, ids);
    std::size_t bytes = 0;
    std::size_t sent = 0;
    for (; sent < std::min(pageSize, shapes->size()) && bytes < kMaxPageBytes; ++sent) {
        bytes += visit((*shapes)[sent], qualities[sent]);
    }
    if (sent == shapes->size()) return std::string();
    const store::Shape& last = (*shapes)[sent - 1];
    return encodeCursor(listing, {last.id, last.updatedAt, last.key});
}

Result<std::vector<std::string>> visitShapes(
    Catalog& catalog, const index::Snapshot& collection, const std::vector<std::string>& keys,
    AnswerRoom& room,
    const std::function<std::size_t(const store::Shape&, std::optional<double> quality)>& visit) {
    RETURN_IF_ERROR(checkKeys(keys));
    const auto found = catalog.getShapes(collection.collection.id, keys);
    RETURN_IF_ERROR(found);
    std::vector<std::int64_t> ids;
    for (const auto& shape : *found) {
        if (shape) ids.push_back(shape->id);
    }
    const auto qualities = catalog.qualities(collection, ids);
    std::vector<std::string> missing;
    for (std::size_t i = 0, next = 0; i < keys.size(); ++i) {
        const std::optional<store::Shape>& shape = (*found)[i];
        if (!shape) {
            missing.push_back(keys[i]);
            continue;
        }
        RETURN_IF_ERROR(room.take(visit(*shape, qualities[next++])));
    }
    return missing;
}

Result<std::uint64_t> countSelected(Catalog& catalog, const index::Snapshot& collection,
                                    const ShapeSelection& selection, const RunContext& context) {
    const auto filter = makeFilter(selection, context);
    RETURN_IF_ERROR(filter);
    return catalog.countShapes(collection.collection.id, *filter);
}

Result<ValueCounts> countByValue(Catalog& catalog, const index::Snapshot& collection,
                                 const ShapeSelection& selection, const std::string& metadataKey,
                                 std::uint32_t maxValues, const RunContext& context) {
    RETURN_IF_ERROR(checkMetadataKey("metadata_key:", metadataKey));
    RETURN_IF_ERROR(checkMaxValues(maxValues));
    auto filter = makeFilter(selection, context);
    RETURN_IF_ERROR(filter);
    std::unordered_map<std::string, std::uint64_t> shapes;
    ValueCounts counts;
    bool tooMany = false;
    // Counted where the store asks which shapes to count.
    const auto accept = std::move(filter->accept);
    filter->accept = [&](const store::Shape& shape) {
        if (tooMany || (accept && !accept(shape))) return false;
        const auto value = shape.metadata.find(metadataKey);
        if (value == shape.metadata.end()) {
            ++counts.without;
            return true;
        }
        ++shapes[value->second];
        tooMany = shapes.size() > kMaxDifferentValues;
        return true;
    };
    RETURN_IF_ERROR(catalog.countShapes(collection.collection.id, *filter));
    if (tooMany) {
        return fail(ErrorCode::kInvalidArgument, "metadata_key: '" + metadataKey + "' has more than " +
                                                     std::to_string(kMaxDifferentValues) +
                                                     " different values: count a narrower filter");
    }
    for (const auto& [value, count] : shapes) counts.values.push_back({value, count});
    std::sort(counts.values.begin(), counts.values.end(), [](const ValueCount& a, const ValueCount& b) {
        return a.shapes != b.shapes ? a.shapes > b.shapes : a.value < b.value;
    });
    const std::size_t named = maxValues == 0 ? kDefaultValues : maxValues;
    for (std::size_t i = named; i < counts.values.size(); ++i) {
        ++counts.otherValues;
        counts.otherShapes += counts.values[i].shapes;
    }
    if (counts.values.size() > named) counts.values.resize(named);
    return counts;
}

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
