// SPDX-License-Identifier: GPL-3.0-or-later
// Listings and counts of shapes.
#include "core/base/return_if_error.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/rows.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

constexpr std::int64_t kLastId = INT64_MAX;

/// The least text above all that begin with `prefix`, byte by byte. Not UTF-8, but only compared: no byte of
/// UTF-8 is 255, so that the last one can be raised.
std::string endOfPrefix(std::string prefix) {
    prefix.back() = static_cast<char>(static_cast<unsigned char>(prefix.back()) + 1);
    return prefix;
}

bool beginsWith(const std::string& key, const std::string& prefix) {
    return key.compare(0, prefix.size(), prefix) == 0;
}

/// Calls `visit` for each shape of the statement that passes `filter`, until it returns false. Throws Failure
/// when the filter's context says so. `byKey`: the keys are in order, so that those with the prefix end.
template <typename Visit>
void forEachAccepted(Query& query, const ShapeFilter& filter, Visit visit, bool byKey = false) {
    forEachShape(query, [&](Shape&& shape) {
        orRaise(filter.context.checkpoint());
        if (!beginsWith(shape.key, filter.keyPrefix)) return !byKey;
        // Not left to SQLite, which would read on for as long as nothing passes.
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
    const std::string& prefix = filter.keyPrefix;
    if (listing.descending) {
        Query query(connection, sql::kListShapesByKeyBackwards);
        if (listing.after) {
            query.bindAll(collectionId, listing.after->key);
        } else if (!prefix.empty()) {
            query.bindAll(collectionId, endOfPrefix(prefix));
        } else {
            query.bindAll(collectionId, BlobView{"", 0});  // a blob is above every text
        }
        return forEachAccepted(query, filter, visit, true);
    }
    const bool continues = listing.after.has_value();
    Query query(connection, continues ? sql::kListShapesByKey : sql::kListShapesFromKey, collectionId,
                continues ? listing.after->key : prefix);
    forEachAccepted(query, filter, visit, true);
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

// Slow, and right while the table can be read: searches tell how many shapes are pending, and a damaged index
// must not stop them.
constexpr char kCountWithoutIndex[] =
    "SELECT count(*) FROM shape NOT INDEXED WHERE collection_id = ?1 AND (?2 < 0 OR state = ?2)";
constexpr char kCountWaitingOneByOne[] =
    "SELECT count(*) FROM shape s NOT INDEXED WHERE s.collection_id = ?1 AND s.state = 0 AND NOT EXISTS "
    "(SELECT 1 "
    "FROM signature g WHERE g.shape_id = s.id)";

std::uint64_t countWithoutIndex(Connection& connection, std::int64_t collectionId,
                                std::optional<ShapeState> state) {
    Query query(connection, kCountWithoutIndex, collectionId, state ? static_cast<int>(*state) : -1);
    return query.step() ? static_cast<std::uint64_t>(query.integer(0)) : 0;
}

}  // namespace

Result<std::vector<Shape>> SqliteStore::listShapes(std::int64_t collectionId, const ShapeListing& listing,
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

Result<std::uint64_t> SqliteStore::countShapes(std::int64_t collectionId, const ShapeFilter& filter) {
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
        const bool whole = unlessDamaged([&] {
            Query query(connection, filter.state ? sql::kCountShapesInState : sql::kCountShapes);
            if (filter.state) {
                query.bindAll(collectionId, static_cast<int>(*filter.state));
            } else {
                query.bindAll(collectionId);
            }
            if (query.step()) count = static_cast<std::uint64_t>(query.integer(0));
        });
        return whole ? count : countWithoutIndex(connection, collectionId, filter.state);
    });
}

Result<std::uint64_t> SqliteStore::countWaiting(std::int64_t collectionId) {
    return read("count the waiting shapes", [&](Connection& connection) {
        std::uint64_t count = 0;
        const auto look = [&](const char* statement) {
            Query query(connection, statement, collectionId);
            if (query.step()) count = static_cast<std::uint64_t>(query.integer(0));
        };
        if (!unlessDamaged([&] { look(sql::kCountWaiting); })) look(kCountWaitingOneByOne);
        return count;
    });
}

}  // namespace shapedb::store
