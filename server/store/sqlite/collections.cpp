// SPDX-License-Identifier: GPL-3.0-or-later
// Collections and their aliases.
#include "core/base/return_if_error.h"
#include "server/store/failpoints.h"
#include "server/store/sqlite/collection_copy.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/rows.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

bool isAlias(Connection& connection, const std::string& name) {
    return Query(connection, sql::kAliasByName, name).step();
}

}  // namespace

void requireFreeName(Connection& connection, const std::string& name) {
    if (findCollection(connection, name)) {
        raise(ErrorCode::kAlreadyExists, "collection '" + name + "' already exists");
    }
    if (isAlias(connection, name)) {
        raise(ErrorCode::kAlreadyExists, "'" + name + "' is an alias of a collection");
    }
}

Result<Collection> SqliteStore::createCollection(const std::string& name, const std::string& description,
                                                 const std::string& parameters) {
    return write("create the collection", [&](Connection& connection) {
        requireFreeName(connection, name);
        Query(connection, sql::kInsertCollection, name, description, parameters, now()).run();
        return requireCollection(connection, connection.lastInsertId());
    });
}

Result<Collection> SqliteStore::getCollection(const std::string& name) {
    return read("read the collection", [&](Connection& connection) {
        auto found = findCollection(connection, name);
        if (!found) raise(ErrorCode::kNotFound, "there is no collection '" + name + "'");
        return std::move(*found);
    });
}

Result<std::vector<Collection>> SqliteStore::listCollections() {
    return read("list the collections", [&](Connection& connection) {
        std::vector<Collection> all;
        try {
            Query query(connection, sql::kListCollections);
            while (query.step()) all.push_back(readCollection(query));
        } catch (const Failure& failure) {
            if (failure.error.code != ErrorCode::kDataLoss) throw;
            all = salvageCollections(connection, failure.error);
        }
        return all;
    });
}

// All rows of a large one in one transaction would need more space than the reserve has, and hold up every
// other write: it gets a name that nobody asks for, and its rows go some at a time.
Result<void> SqliteStore::deleteCollection(std::int64_t collectionId, const std::function<void()>& gone) {
    const auto whole = remove("delete the collection", [&](Connection& connection) {
        requireCollection(connection, collectionId);
        if (deleteSome(connection, collectionId)) return true;
        Query(connection, sql::kDeleteAliasesOf, collectionId).run();
        Query(connection, sql::kCancelRebuildsOf, collectionId, now()).run();
        Query(connection, sql::kRenameCollection, collectionId,
              sql::kDeletedPrefix + std::to_string(collectionId))
            .run();
        return false;
    });
    RETURN_IF_ERROR(whole);
    SHAPEDB_FAILPOINT("delete.hidden");
    if (gone) gone();
    const auto dropped = dropDeleted();
    return *whole ? Result<void>() : dropped;
}

Result<Collection> SqliteStore::renameCollection(std::int64_t collectionId, const std::string& name) {
    return write("rename the collection", [&](Connection& connection) {
        if (requireCollection(connection, collectionId).name != name) {
            requireFreeName(connection, name);
            Query(connection, sql::kRenameCollection, collectionId, name).run();
        }
        return requireCollection(connection, collectionId);
    });
}

Result<void> SqliteStore::setAlias(const std::string& name, std::int64_t collectionId) {
    return write("set the alias", [&](Connection& connection) {
        requireCollection(connection, collectionId);
        if (findCollection(connection, name)) {
            raise(ErrorCode::kAlreadyExists, "'" + name + "' is the name of a collection");
        }
        Query(connection, sql::kPutAlias, name, collectionId).run();
    });
}

Result<void> SqliteStore::deleteAlias(const std::string& name) {
    return write("delete the alias", [&](Connection& connection) {
        if (!isAlias(connection, name)) raise(ErrorCode::kNotFound, "there is no alias '" + name + "'");
        Query(connection, sql::kDeleteAlias, name).run();
    });
}

Result<std::vector<Alias>> SqliteStore::listAliases() {
    return read("list the aliases", [](Connection& connection) {
        std::vector<Alias> all;
        const bool whole = unlessDamaged([&] {
            Query query(connection, sql::kListAliases);
            while (query.step()) all.push_back({query.text(0), query.integer(1)});
        });
        return whole ? all : salvageAliases(connection);
    });
}

}  // namespace shapedb::store
