// SPDX-License-Identifier: GPL-3.0-or-later
// Query plans: what has to be logarithmic uses an index.
#include <list>
#include <set>
#include <string>
#include <vector>

#include "server/store/sqlite/migrator.h"
#include "server/store/sqlite/sqlite_sql.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class SqlitePlanTest : public ::testing::Test {
  protected:
    SqlitePlanTest() { migrate(connection_, embeddedMigrations(), 1); }

    std::string plan(const std::string& sql) {
        texts_.push_back("EXPLAIN QUERY PLAN " + sql);
        std::string lines;
        Query query(connection_, texts_.back().c_str());
        while (query.step()) lines += query.text(3) + "\n";
        return lines;
    }

    std::list<std::string> texts_;  ///< kept: the address of a text is its key among prepared statements
    SqliteConnection connection_{":memory:", OpenMode::kReadWriteCreate, 0};
};

/// Few rows, or a total that nobody asks for often.
bool mayReadAWholeTable(const std::string& name) {
    static const std::set<std::string> names = {"kListCollections", "kListAliases",       "kCountCollections",
                                                "kRunningRebuilds", "kCountStates",       "kCountSignatures",
                                                "kListNotices",     "kRememberedDeletion"};
    return names.count(name) > 0;
}

TEST_F(SqlitePlanTest, OnlyNamedStatementsReadWholeTablesOrSort) {
    std::vector<sql::Statement> all(std::begin(sql::kStatements), std::end(sql::kStatements));
    all.insert(all.end(), std::begin(sqlite_sql::kStatements), std::end(sqlite_sql::kStatements));
    for (const sql::Statement& statement : all) {
        const std::string lines = plan(statement.text);
        const bool scans = lines.find("SCAN") != std::string::npos;
        const bool sorts = lines.find("TEMP B-TREE") != std::string::npos;
        EXPECT_EQ(scans || sorts, mayReadAWholeTable(statement.name))
            << statement.name << ": " << statement.text << "\n"
            << lines;
    }
}

TEST_F(SqlitePlanTest, PagesStartAtTheirCursor) {
    EXPECT_NE(plan(sql::kListShapes).find("shape_by_collection (collection_id=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kListShapes);
    EXPECT_NE(plan(sql::kListShapesInState).find("shape_by_state (collection_id=? AND state=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kListShapesInState);
    EXPECT_NE(plan(sql::kListShapesBackwards).find("shape_by_collection (collection_id=? AND rowid<?)"),
              std::string::npos)
        << plan(sql::kListShapesBackwards);
    for (const char* byKey :
         {sql::kListShapesFromKey, sql::kListShapesByKey, sql::kListShapesByKeyBackwards}) {
        EXPECT_NE(plan(byKey).find("sqlite_autoindex_shape_1 (collection_id=? AND key"), std::string::npos)
            << plan(byKey);
    }
    EXPECT_NE(plan(sql::kListShapesFromLastKey).find("sqlite_autoindex_shape_1 (collection_id=?)"),
              std::string::npos)
        << plan(sql::kListShapesFromLastKey);
    for (const char* byChange : {sql::kListShapesByChange, sql::kListShapesByChangeBackwards}) {
        EXPECT_NE(plan(byChange).find("shape_by_change (collection_id=? AND updated_at"), std::string::npos)
            << plan(byChange);
    }
    for (const char* ofChange : {sql::kListShapesOfChange, sql::kListShapesOfChangeBackwards}) {
        EXPECT_NE(plan(ofChange).find("shape_by_change (collection_id=? AND updated_at=? AND rowid"),
                  std::string::npos)
            << plan(ofChange);
    }
    EXPECT_NE(plan(sql::kLoadIndex).find("shape_by_collection (collection_id=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kLoadIndex);
    EXPECT_NE(plan(sql::kRebuildBatch).find("shape_by_collection (collection_id=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kRebuildBatch);
    EXPECT_NE(plan(sql::kNextJob).find("job_by_state (state=?)"), std::string::npos) << plan(sql::kNextJob);
}

// The checks above can fail: without its index the statement scans.
TEST_F(SqlitePlanTest, ADroppedIndexShowsInThePlan) {
    connection_.execute("DROP INDEX job_by_state");
    EXPECT_NE(plan(sql::kNextJob).find("SCAN"), std::string::npos) << plan(sql::kNextJob);
}

}  // namespace
}  // namespace shapedb::store
