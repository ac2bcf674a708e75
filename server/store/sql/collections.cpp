// SPDX-License-Identifier: GPL-3.0-or-later
// Collections and their aliases.
#include <chrono>

#include "core/base/return_if_error.h"
#include "server/store/failpoints.h"
#include "server/store/sql/collection_copy.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql_store.h"

namespace shapedb::store {

namespace {

bool isAlias(Connection& connection, const std::string& name) {
    return Query(connection, sql::kAliasByName, name).step();
}

std::optional<std::int64_t> firstId(Connection& connection, const char* statement,
                                    const std::optional<std::string>& name) {
    Query query(connection, statement);
    if (name) query.bindAll(*name);
    if (!query.step()) return std::nullopt;
    return query.integer(0);
}

}  // namespace

TimestampMs systemNow() {
    using std::chrono::duration_cast;
    return duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

void requireCompressionLevel(int level) {
    if (level >= 1 && level <= 19) return;
    raise(ErrorCode::kInvalidArgument, "the compression level must be 1 to 19, not " + std::to_string(level));
}

void requireFreeName(Connection& connection, const std::string& name) {
    if (findCollection(connection, name)) {
        raise(ErrorCode::kAlreadyExists, "collection '" + name + "' already exists");
    }
    if (isAlias(connection, name)) {
        raise(ErrorCode::kAlreadyExists, "'" + name + "' is an alias of a collection");
    }
}

Result<Collection> SqlStore::createCollection(const std::string& name, const std::string& description,
                                              const std::string& parameters) {
    return write("create the collection", [&](Connection& connection) {
        lockNames(connection);
        requireFreeName(connection, name);
        const std::int64_t id =
            numberOf(Query(connection, sql::kInsertCollection, name, description, parameters, now()));
        return requireCollection(connection, id);
    });
}

Result<Collection> SqlStore::getCollection(const std::string& name) {
    return read("read the collection", [&](Connection& connection) {
        auto found = findCollection(connection, name);
        if (!found) raise(ErrorCode::kNotFound, "there is no collection '" + name + "'");
        return std::move(*found);
    });
}

Result<std::vector<Collection>> SqlStore::listCollections() {
    return read("list the collections", [&](Connection& connection) {
        std::vector<Collection> all;
        try {
            Query query(connection, sql::kListCollections);
            while (query.step()) all.push_back(readCollection(query));
        } catch (const Failure& failure) {
            all = salvageCollections(connection, failure);
        }
        return all;
    });
}

// All rows of a large one in one transaction would need more space than the reserve has, and hold up every
// other write: it gets a name that nobody asks for, and its rows go some at a time.
Result<void> SqlStore::deleteCollection(std::int64_t collectionId, const std::function<void()>& gone) {
    const auto whole = remove("delete the collection", [&](Connection& connection) {
        lockNames(connection);
        lockCollection(connection, collectionId);
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

Result<Collection> SqlStore::renameCollection(std::int64_t collectionId, const std::string& name) {
    return write("rename the collection", [&](Connection& connection) {
        lockNames(connection);
        if (requireCollection(connection, collectionId).name != name) {
            requireFreeName(connection, name);
            Query(connection, sql::kRenameCollection, collectionId, name).run();
        }
        return requireCollection(connection, collectionId);
    });
}

Result<void> SqlStore::setAlias(const std::string& name, std::int64_t collectionId) {
    return write("set the alias", [&](Connection& connection) {
        lockNames(connection);
        requireCollection(connection, collectionId);
        if (findCollection(connection, name)) {
            raise(ErrorCode::kAlreadyExists, "'" + name + "' is the name of a collection");
        }
        Query(connection, sql::kPutAlias, name, collectionId).run();
    });
}

Result<void> SqlStore::deleteAlias(const std::string& name) {
    return write("delete the alias", [&](Connection& connection) {
        lockNames(connection);
        if (!isAlias(connection, name)) raise(ErrorCode::kNotFound, "there is no alias '" + name + "'");
        Query(connection, sql::kDeleteAlias, name).run();
    });
}

Result<std::vector<Alias>> SqlStore::listAliases() {
    return read("list the aliases", [this](Connection& connection) {
        std::vector<Alias> all;
        try {
            Query query(connection, sql::kListAliases);
            while (query.step()) all.push_back({query.text(0), query.integer(1)});
        } catch (const Failure& failure) {
            all = salvageAliases(connection, failure);
        }
        return all;
    });
}

std::string SqlStore::importName() const { return sql::kImporting; }

std::vector<Collection> SqlStore::salvageCollections(Connection&, const Failure& damage) { throw damage; }

std::vector<Alias> SqlStore::salvageAliases(Connection&, const Failure& damage) { throw damage; }

Result<void> SqlStore::dropDeleted() noexcept {
    return dropHidden("remove what was deleted", sql::kSomeDeletedCollection, std::nullopt);
}

Result<void> SqlStore::dropHidden(const char* operation, const char* statement,
                                  const std::optional<std::string>& name) noexcept {
    const auto there = read(
        operation, [&](Connection& connection) { return firstId(connection, statement, name).has_value(); });
    RETURN_IF_ERROR(there);
    if (!*there) return {};
    while (true) {
        const auto more = remove(operation, [&](Connection& connection) {
            const auto found = firstId(connection, statement, name);
            if (!found) return false;
            lockCollection(connection, *found);
            deleteSome(connection, *found);
            SHAPEDB_FAILPOINT("delete.some");
            return true;
        });
        RETURN_IF_ERROR(more);
        if (!*more) return {};
    }
}

}  // namespace shapedb::store
