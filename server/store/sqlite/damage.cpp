// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/damage.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <new>
#include <optional>
#include <string_view>

#include <sqlite3.h>

#include "server/store/sql/rows.h"

namespace shapedb::store {

namespace {

/// Small tables of the database, and what is out of service when one of them is damaged.
struct SmallTable {
    const char* name;
    const char* consequence;
};
constexpr char kJobs[] = "job";
constexpr SmallTable kSmallTables[] = {
    {"sqlite_sequence", "nothing can be added"},
    {"tally", "nothing can be changed"},
    {"collection", "collections whose row cannot be read are out of service, the others are served"},
    {"collection_alias", "aliases that cannot be read are unknown"},
    {kJobs, "no scan is taken in, searches are answered"},
    {"rebuild", "rebuilds do not run"},
    {"rebuild_failure", "rebuilds do not run"},
};

// The index over the names holds name and id.
constexpr char kNamesByIndex[] =
    "SELECT id, name FROM collection INDEXED BY sqlite_autoindex_collection_1 ORDER BY name";
constexpr char kIdsByTable[] = "SELECT id FROM collection NOT INDEXED ORDER BY id";
constexpr char kNextCollectionOfShapes[] =
    "SELECT collection_id FROM shape WHERE collection_id > ?1 ORDER BY collection_id LIMIT 1";
constexpr char kCollectionsOfAliases[] = "SELECT collection_id FROM collection_alias";
constexpr char kAliasesByIndex[] =
    "SELECT name, collection_id FROM collection_alias INDEXED BY collection_alias_by_collection";

/// Ids of collections, wherever one is mentioned, with the name if the index over the names tells it.
std::map<std::int64_t, std::string> mentioned(SqliteConnection& connection) {
    std::map<std::int64_t, std::string> found;
    unlessDamaged([&] {
        Query query(connection, kNamesByIndex);
        while (query.step()) found[query.integer(0)] = query.text(1);
    });
    for (const char* statement : {kIdsByTable, kCollectionsOfAliases}) {
        unlessDamaged([&] {
            Query query(connection, statement);
            while (query.step()) found[query.integer(0)];
        });
    }
    unlessDamaged([&] {
        for (std::int64_t last = 0;;) {
            Query query(connection, kNextCollectionOfShapes, last);
            if (!query.step()) return;
            last = query.integer(0);
            found[last];
        }
    });
    return found;
}

/// Empty if the table can be read.
std::optional<std::string> damageOf(SqliteConnection& connection, const SmallTable& table) {
    std::string line;
    try {
        line = connection.text(std::string("PRAGMA quick_check(") + table.name + ")");
    } catch (const Failure& failure) {
        if (failure.error.code != ErrorCode::kDataLoss) throw;
        line = failure.error.message;
    }
    raiseUnreadable(line);
    if (line == "ok" || line.empty()) return std::nullopt;
    std::replace(line.begin(), line.end(), '\n', ' ');
    return "table " + std::string(table.name) + " is damaged (" + line + "): " + table.consequence + "; " +
           kDamageRemedy;
}

}  // namespace

void raiseUnreadable(const std::string& line) {
    // A page of the list of free ones comes without a code; a wrong number would have been noticed before.
    if (line.find(kMissingPage) != std::string::npos)
        raise(ErrorCode::kStorage, "the database cannot be read: " + line);
    static constexpr std::string_view kReason = "error code=";
    const std::size_t at = line.find(kReason);
    if (at == std::string::npos) return;
    switch (std::atoi(line.c_str() + at + kReason.size()) & 0xff) {
        case SQLITE_IOERR: raise(ErrorCode::kStorage, "the database cannot be read: " + line);
        case SQLITE_NOMEM: throw std::bad_alloc();
        default: return;
    }
}

std::vector<std::string> damagedTables(SqliteConnection& connection, std::optional<std::string>& queue) {
    std::vector<std::string> damaged;
    for (const SmallTable& table : kSmallTables) {
        auto line = damageOf(connection, table);
        if (!line) continue;
        if (table.name == kJobs) queue = *line;
        damaged.push_back(std::move(*line));
    }
    return damaged;
}

std::vector<Collection> salvageCollections(SqliteConnection& connection, const Error& listing) {
    std::vector<Collection> all;
    for (const auto& [id, name] : mentioned(connection)) {
        std::optional<Collection> row;
        const bool readable = unlessDamaged([&, wanted = id] {
            Query query(connection, sql::kCollectionById, wanted);
            if (query.step()) row = readCollection(query);
        });
        if (!readable) {
            row.emplace();
            row->id = id;
            row->name = name;
            row->damage = listing;
        }
        if (row && !sql::isHidden(row->name)) all.push_back(std::move(*row));
    }
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return all;
}

std::vector<Alias> salvageAliases(SqliteConnection& connection) {
    std::vector<Alias> all;
    Query query(connection, kAliasesByIndex);
    while (query.step()) all.push_back({query.text(0), query.integer(1)});
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return all;
}

}  // namespace shapedb::store
