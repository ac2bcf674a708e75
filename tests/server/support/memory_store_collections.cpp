// SPDX-License-Identifier: GPL-3.0-or-later
// Collections and their aliases.
#include <algorithm>

#include "tests/server/support/memory_store.h"

namespace shapedb::testing {

using namespace shapedb::store;

Result<Collection> MemoryStore::createCollection(const std::string& name, const std::string& description,
                                                 const std::string& parameters) {
    return guarded("createCollection", [&]() -> Result<Collection> {
        if (isTaken(name)) return fail(ErrorCode::kAlreadyExists, "the name is taken");
        Collection collection;
        collection.id = content_.nextId++;
        collection.name = name;
        collection.description = description;
        collection.parameters = parameters;
        collection.createdAt = now();
        return content_.collections[collection.id] = collection;
    });
}

Result<Collection> MemoryStore::getCollection(const std::string& name) {
    return guarded("getCollection", [&]() -> Result<Collection> {
        for (const auto& [id, collection] : content_.collections) {
            if (collection.name == name) return collection;
        }
        return fail(ErrorCode::kNotFound, "no such collection");
    });
}

Result<std::vector<Collection>> MemoryStore::listCollections() {
    return guarded("listCollections", [&]() -> Result<std::vector<Collection>> {
        std::vector<Collection> all;
        for (const auto& [id, collection] : content_.collections) all.push_back(collection);
        std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
        return all;
    });
}

Result<void> MemoryStore::deleteCollection(std::int64_t collectionId, const std::function<void()>& gone) {
    auto deleted = guarded("deleteCollection", [&]() -> Result<void> {
        if (content_.collections.erase(collectionId) == 0)
            return fail(ErrorCode::kNotFound, "no such collection");
        for (auto alias = content_.aliases.begin(); alias != content_.aliases.end();) {
            alias = alias->second == collectionId ? content_.aliases.erase(alias) : std::next(alias);
        }
        std::vector<std::int64_t> ids;
        for (const auto& [id, shape] : content_.shapes) {
            if (shape.collectionId == collectionId) ids.push_back(id);
        }
        for (const std::int64_t id : ids) removeShape(id);
        for (auto rebuild = content_.rebuilds.begin(); rebuild != content_.rebuilds.end();) {
            const bool its = rebuild->second.collectionId == collectionId;
            if (its) content_.rebuilt.erase(rebuild->first);
            rebuild = its ? content_.rebuilds.erase(rebuild) : std::next(rebuild);
        }
        return {};
    });
    if (deleted && gone) gone();
    return deleted;
}

bool MemoryStore::isTaken(const std::string& name) const {
    return content_.aliases.count(name) > 0 ||
           std::any_of(content_.collections.begin(), content_.collections.end(),
                       [&](const auto& entry) { return entry.second.name == name; });
}

Result<Collection> MemoryStore::renameCollection(std::int64_t collectionId, const std::string& name) {
    return guarded("renameCollection", [&]() -> Result<Collection> {
        const auto found = content_.collections.find(collectionId);
        if (found == content_.collections.end()) return fail(ErrorCode::kNotFound, "no such collection");
        if (found->second.name != name && isTaken(name)) {
            return fail(ErrorCode::kAlreadyExists, "the name is taken");
        }
        found->second.name = name;
        return found->second;
    });
}

Result<void> MemoryStore::setAlias(const std::string& name, std::int64_t collectionId) {
    return guarded("setAlias", [&]() -> Result<void> {
        if (content_.collections.count(collectionId) == 0) {
            return fail(ErrorCode::kNotFound, "no such collection");
        }
        if (content_.aliases.count(name) == 0 && isTaken(name)) {
            return fail(ErrorCode::kAlreadyExists, "the name of a collection");
        }
        content_.aliases[name] = collectionId;
        return {};
    });
}

Result<void> MemoryStore::deleteAlias(const std::string& name) {
    return guarded("deleteAlias", [&]() -> Result<void> {
        if (content_.aliases.erase(name) == 0) return fail(ErrorCode::kNotFound, "no such alias");
        return {};
    });
}

Result<std::vector<Alias>> MemoryStore::listAliases() {
    return guarded("listAliases", [&]() -> Result<std::vector<Alias>> {
        std::vector<Alias> all;
        for (const auto& [name, id] : content_.aliases) all.push_back({name, id});
        return all;
    });
}

}  // namespace shapedb::testing
