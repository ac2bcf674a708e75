// SPDX-License-Identifier: GPL-3.0-or-later
// Listing, and changes of many shapes.
#include <algorithm>
#include <tuple>

#include "server/store/put_rules.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::testing {

using namespace shapedb::store;

namespace {

bool accepts(const ShapeFilter& filter, const Shape& shape) {
    return (!filter.state || *filter.state == shape.state) && shape.key.rfind(filter.keyPrefix, 0) == 0 &&
           (!filter.accept || filter.accept(shape));
}

ShapeListing::Place placeOf(const Shape& shape) { return {shape.id, shape.updatedAt, shape.key}; }

/// In ascending order.
bool standsBefore(ShapeOrder order, const ShapeListing::Place& a, const ShapeListing::Place& b) {
    switch (order) {
        case ShapeOrder::kId: return a.id < b.id;
        case ShapeOrder::kKey: return a.key < b.key;
        case ShapeOrder::kUpdated: return std::tie(a.updatedAt, a.id) < std::tie(b.updatedAt, b.id);
    }
    return false;
}

tl::unexpected<Error> noShape() { return fail(ErrorCode::kNotFound, "no such shape"); }

}  // namespace

Result<std::vector<std::optional<Shape>>> MemoryStore::getShapes(std::int64_t collectionId,
                                                                 const std::vector<std::string>& keys) {
    return guarded("getShapes", [&]() -> Result<std::vector<std::optional<Shape>>> {
        std::vector<std::optional<Shape>> found;
        for (const std::string& key : keys) {
            const Shape* shape = find(collectionId, key);
            found.push_back(shape != nullptr ? std::optional<Shape>(*shape) : std::nullopt);
        }
        return found;
    });
}

Result<std::vector<Shape>> MemoryStore::listShapes(std::int64_t collectionId, const ShapeListing& listing,
                                                   std::size_t limit, const ShapeFilter& filter) {
    return guarded("listShapes", [&] { return list(collectionId, listing, limit, filter); });
}

Result<std::vector<Shape>> MemoryStore::list(std::int64_t collectionId, const ShapeListing& listing,
                                             std::size_t limit, const ShapeFilter& filter) const {
    const auto before = [&](const ShapeListing::Place& a, const ShapeListing::Place& b) {
        return listing.descending ? standsBefore(listing.order, b, a) : standsBefore(listing.order, a, b);
    };
    std::vector<Shape> all;
    for (const auto& [id, shape] : content_.shapes) {
        if (shape.collectionId != collectionId) continue;
        if (listing.after && !before(*listing.after, placeOf(shape))) continue;
        all.push_back(shape);
    }
    std::sort(all.begin(), all.end(),
              [&](const Shape& a, const Shape& b) { return before(placeOf(a), placeOf(b)); });
    std::vector<Shape> page;
    for (const Shape& shape : all) {
        if (page.size() == limit) break;
        if (const auto go = filter.context.checkpoint(); !go) return fail(go.error());
        if (accepts(filter, shape)) page.push_back(shape);
    }
    return page;
}

Result<std::uint64_t> MemoryStore::countShapes(std::int64_t collectionId, const ShapeFilter& filter) {
    return guarded("countShapes", [&]() -> Result<std::uint64_t> {
        const auto all = list(collectionId, {}, ~std::size_t{0}, filter);
        if (!all) return fail(all.error());
        return all->size();
    });
}

Result<std::uint64_t> MemoryStore::countWaiting(std::int64_t collectionId) {
    ShapeFilter filter;
    filter.state = ShapeState::kPending;
    filter.accept = [&](const Shape& shape) {
        const auto found = content_.signatures.find(shape.id);
        return found == content_.signatures.end() ||
               found->second.generation != content_.collections.at(collectionId).generation;
    };
    return countShapes(collectionId, filter);
}

Result<Shape> MemoryStore::deleteShape(std::int64_t collectionId, const std::string& key,
                                       std::optional<std::int64_t> expectedVersion) {
    return guarded("deleteShape", [&]() -> Result<Shape> {
        const Shape* found = find(collectionId, key);
        for (auto past = content_.deleted.rbegin(); found == nullptr && past != content_.deleted.rend();
             ++past) {
            if (past->collectionId == collectionId && past->key == key && past->version == expectedVersion)
                return *past;
        }
        if (found == nullptr) return noShape();
        const auto version = requireVersion(key, found->version, expectedVersion);
        if (!version) return fail(version.error());
        const Shape shape = *found;
        removeShape(shape.id);
        if (expectedVersion) content_.deleted.push_back(shape);
        return shape;
    });
}

Result<std::vector<Shape>> MemoryStore::deleteShapes(const std::vector<std::int64_t>& shapeIds,
                                                     const std::function<bool(const Shape&)>& still) {
    return guarded("deleteShapes", [&]() -> Result<std::vector<Shape>> {
        std::vector<Shape> deleted;
        for (const std::int64_t id : shapeIds) {
            const auto found = content_.shapes.find(id);
            if (found == content_.shapes.end() || !still(found->second)) continue;
            deleted.push_back(found->second);
            removeShape(id);
        }
        return deleted;
    });
}

Result<std::vector<Shape>> MemoryStore::changeMetadata(
    const std::vector<std::int64_t>& shapeIds,
    const std::function<std::optional<Metadata>(const Shape&)>& change) {
    return guarded("changeMetadata", [&]() -> Result<std::vector<Shape>> {
        std::vector<Shape> changed;
        for (const std::int64_t id : shapeIds) {
            const auto found = content_.shapes.find(id);
            if (found == content_.shapes.end()) continue;
            Shape& shape = found->second;
            const auto metadata = change(shape);
            if (!metadata || *metadata == shape.metadata) continue;
            shape.metadata = *metadata;
            shape.version += 1;
            shape.updatedAt = now();
            changed.push_back(shape);
        }
        return changed;
    });
}

}  // namespace shapedb::testing
