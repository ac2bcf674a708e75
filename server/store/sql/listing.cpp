// SPDX-License-Identifier: GPL-3.0-or-later
// Listings and counts of shapes.
#include "core/base/return_if_error.h"
#include "server/store/key_rules.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql_store.h"

namespace shapedb::store {

namespace {

constexpr std::int64_t kLastId = INT64_MAX;

/// Without a character that is cut off at its end: databases take texts of whole characters.
std::string wholeCharacters(const std::string& text) {
    std::size_t begin = text.size();
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    while (begin > 0 && (byte(begin - 1) & 0xC0) == 0x80) --begin;
    if (begin == 0) return {};
    const unsigned char lead = byte(begin - 1);
    const std::size_t size = lead < 0x80 ? 1 : lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
    return text.size() - (begin - 1) >= size ? text : text.substr(0, begin - 1);
}

/// A text above all keys that begin with `prefix`, byte by byte: it goes on with the last character that
/// there is for longer than a key may be.
std::string endOfPrefix(std::string prefix) {
    while (prefix.size() <= kMaxKeyBytes) prefix += "\xF4\x8F\xBF\xBF";
    return prefix;
}

bool beginsWith(const std::string& key, const std::string& prefix) {
    return key.compare(0, prefix.size(), prefix) == 0;
}

enum class Order { kOther, kByKey, kByKeyBackwards };

/// Calls `visit` for each shape of the statement that passes `filter`, until it returns false. Throws Failure
/// when the filter's context says so. In the order of keys those with the prefix come together.
template <typename Visit>
void forEachAccepted(Query& query, const ShapeFilter& filter, Visit visit, Order order = Order::kOther) {
    forEachShape(query, [&](Shape&& shape) {
        orRaise(filter.context.checkpoint());
        if (!beginsWith(shape.key, filter.keyPrefix)) {
            const bool isBefore = shape.key < filter.keyPrefix;
            return order == Order::kOther || isBefore == (order == Order::kByKey);
        }
        // Not left to the database, which would read on for as long as nothing passes.
        if (filter.state && *filter.state != shape.state) return true;
        if (filter.accept && !filter.accept(shape)) return true;
        return visit(std::move(shape));
    });
}

template <typename Visit>
void byId(Connection& connection, std::int64_t collectionId, const ShapeListing& listing,
          const ShapeFilter& filter, Visit visit) {
    if (listing.descending) {
        const std::int64_t before = listing.after ? listing.after->id : kLastId;
        Query query(connection, sql::kListShapesBackwards, collectionId, before);
        return forEachAccepted(query, filter, visit);
    }
    const std::int64_t after = listing.after ? listing.after->id : 0;
    if (filter.state) {
        Query query(connection, sql::kListShapesInState, collectionId, after,
                    static_cast<int>(*filter.state));
        return forEachAccepted(query, filter, visit);
    }
    Query query(connection, sql::kListShapes, collectionId, after);
    forEachAccepted(query, filter, visit);
}

/// From the first key that begins with the prefix to the last.
template <typename Visit>
void byKey(Connection& connection, std::int64_t collectionId, const ShapeListing& listing,
           const ShapeFilter& filter, Visit visit) {
    const std::string prefix = wholeCharacters(filter.keyPrefix);
    const bool continues = listing.after.has_value();
    if (!listing.descending) {
        Query query(connection, continues ? sql::kListShapesByKey : sql::kListShapesFromKey, collectionId,
                    continues ? listing.after->key : prefix);
        return forEachAccepted(query, filter, visit, Order::kByKey);
    }
    if (!continues && prefix.empty()) {
        Query query(connection, sql::kListShapesFromLastKey, collectionId);
        return forEachAccepted(query, filter, visit, Order::kByKeyBackwards);
    }
    Query query(connection, sql::kListShapesByKeyBackwards, collectionId,
                continues ? listing.after->key : endOfPrefix(prefix));
    forEachAccepted(query, filter, visit, Order::kByKeyBackwards);
}

template <typename Visit>
void byTimeOfChange(Connection& connection, std::int64_t collectionId, const ShapeListing& listing,
                    const ShapeFilter& filter, Visit visit) {
    bool more = true;
    const auto noting = [&](Shape&& shape) { return more = visit(std::move(shape)); };
    const bool back = listing.descending;
    if (listing.after) {
        Query query(connection, back ? sql::kListShapesOfChangeBackwards : sql::kListShapesOfChange,
                    collectionId, listing.after->updatedAt, listing.after->id);
        forEachAccepted(query, filter, noting);
    }
    if (!more) return;
    const TimestampMs beyond = listing.after ? listing.after->updatedAt : back ? INT64_MAX : INT64_MIN;
    Query query(connection, back ? sql::kListShapesByChangeBackwards : sql::kListShapesByChange, collectionId,
                beyond);
    forEachAccepted(query, filter, noting);
}

template <typename Visit>
void inOrder(Connection& connection, std::int64_t collectionId, const ShapeListing& listing,
             const ShapeFilter& filter, Visit visit) {
    switch (listing.order) {
        case ShapeOrder::kId: return byId(connection, collectionId, listing, filter, visit);
        case ShapeOrder::kKey: return byKey(connection, collectionId, listing, filter, visit);
        case ShapeOrder::kUpdated: return byTimeOfChange(connection, collectionId, listing, filter, visit);
    }
}

}  // namespace

Result<std::vector<Shape>> SqlStore::listShapes(std::int64_t collectionId, const ShapeListing& listing,
                                                std::size_t limit, const ShapeFilter& filter) {
    return read("list the shapes", [&](Connection& connection) {
        std::vector<Shape> page;
        if (limit == 0) return page;
        inOrder(connection, collectionId, listing, filter, [&](Shape&& shape) {
            page.push_back(std::move(shape));
            return page.size() < limit;
        });
        return page;
    });
}

Result<std::uint64_t> SqlStore::countShapes(std::int64_t collectionId, const ShapeFilter& filter) {
    return read("count the shapes", [&](Connection& connection) {
        std::uint64_t count = 0;
        if (filter.accept || !filter.keyPrefix.empty()) {
            ShapeListing listing;
            // Reads no key that does not begin with the prefix.
            if (!filter.keyPrefix.empty()) listing.order = ShapeOrder::kKey;
            inOrder(connection, collectionId, listing, filter, [&](Shape&&) {
                ++count;
                return true;
            });
            return count;
        }
        lookUp(connection, filter.state ? sql::kCountShapesInState : sql::kCountShapes, [&](const char* sql) {
            Query query(connection, sql);
            if (filter.state) {
                query.bindAll(collectionId, static_cast<int>(*filter.state));
            } else {
                query.bindAll(collectionId);
            }
            if (query.step()) count = static_cast<std::uint64_t>(query.integer(0));
        });
        return count;
    });
}

Result<std::uint64_t> SqlStore::countWaiting(std::int64_t collectionId) {
    return read("count the waiting shapes", [&](Connection& connection) {
        std::uint64_t count = 0;
        lookUp(connection, sql::kCountWaiting, [&](const char* sql) {
            count = static_cast<std::uint64_t>(numberOf(Query(connection, sql, collectionId)));
        });
        return count;
    });
}

}  // namespace shapedb::store
