// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/row_copy.h"

#include <vector>

#include <sqlite3.h>

#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/database_file.h"

namespace shapedb::store {

namespace {

constexpr char kAttach[] = "ATTACH ?1 AS damaged";
constexpr char kTables[] =
    "SELECT name, wr FROM pragma_table_list WHERE schema = 'main' AND type = 'table' AND name <> "
    "'sqlite_schema'";

struct Table {
    std::string name;
    std::string how;  ///< to read it without any other index
};

std::vector<Table> tablesIn(SqliteConnection& connection) {
    std::vector<Table> tables;
    Query query(connection, kTables);
    while (query.step()) {
        // A table WITHOUT ROWID is the index of its primary key.
        const std::string name = query.text(0);
        tables.push_back({name, query.integer(1) != 0 ? " INDEXED BY sqlite_autoindex_" + name + "_1"
                                                      : std::string(" NOT INDEXED")});
    }
    return tables;
}

void copyAll(SqliteConnection& target, const RunContext& context) {
    const std::vector<Table> tables = tablesIn(target);
    // Begun as a read, so that it locks only what it writes to. In one snapshot of the other database.
    Transaction transaction(target, Transaction::Kind::kRead);
    for (std::size_t i = 0; i < tables.size(); ++i) {
        orRaise(context.checkpoint());
        context.report("backup", i, tables.size());
        // Without a condition SQLite would copy the indices, too.
        const Table& table = tables[i];
        target.execute("DELETE FROM main." + table.name + "; INSERT INTO main." + table.name +
                       " SELECT * FROM damaged." + table.name + table.how + " WHERE true");
    }
    transaction.commit();
}

}  // namespace

bool copyRows(const std::string& from, const std::string& to, const SqliteOptions& options,
              const RunContext& context) {
    SqliteConnection target(to, OpenMode::kReadWrite, options.busyTimeoutMs);
    makeEmptyDatabase(target, options.now());
    // The sums that triggers keep are copied as well.
    sqlite3_db_config(target.handle(), SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    target.execute("PRAGMA foreign_keys=OFF");
    Query(target, kAttach, from).run();
    const Interruptible interruptible(target, context);
    try {
        copyAll(target, context);
        return true;
    } catch (const Failure& failure) {
        orRaise(context.checkpoint());  // reports the caller's reason instead of SQLite's "interrupted"
        // Rows that break a constraint, too: kInternal.
        if (failure.error.code != ErrorCode::kDataLoss && failure.error.code != ErrorCode::kInternal) throw;
        return false;
    }
}

}  // namespace shapedb::store
