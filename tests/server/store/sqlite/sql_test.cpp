// The promises about cost: what must be logarithmic is answered from an index.
#include "server/store/sqlite/sql.h"

#include "server/store/sqlite/migrator.h"
#include "tests/server/store/sqlite/store_fixture.h"

namespace shapedb::store {
namespace {

class SqlitePlanTest : public ::testing::Test {
  protected:
    SqlitePlanTest() { migrate(connection_, embeddedMigrations(), 1); }

    std::string plan(const std::string& sql) {
        const std::string explain = "EXPLAIN QUERY PLAN " + sql;
        std::string lines;
        Query query(connection_, explain.c_str());
        while (query.step()) lines += query.text(3) + "\n";
        return lines;
    }

    Connection connection_{":memory:", OpenMode::kReadWriteCreate, 0};
};

TEST_F(SqlitePlanTest, NothingHotScansOrSorts) {
    for (const char* sql : {sql::kCollectionByName,
                            sql::kCollectionById,
                            sql::kShapeByKey,
                            sql::kShapeById,
                            sql::kListShapes,
                            sql::kListShapesInState,
                            sql::kCountShapes,
                            sql::kCountShapesInState,
                            sql::kLoadPoints,
                            sql::kServingSignature,
                            sql::kPutSignature,
                            sql::kDeleteSignatures,
                            sql::kDeleteSignature,
                            sql::kLoadIndex,
                            sql::kNextJob,
                            sql::kStartJob,
                            sql::kCurrentJob,
                            sql::kReleaseJob,
                            sql::kDeleteJob,
                            sql::kRunningJobs,
                            sql::kTally,
                            sql::kRebuildById,
                            sql::kRunningRebuildOf,
                            sql::kCountRebuilt,
                            sql::kCountRebuildFailures,
                            sql::kRebuildBatch,
                            sql::kCurrentPoints,
                            sql::kDeleteRebuildFailuresOfShape,
                            sql::kSetReadyRebuilt,
                            sql::kSetFailedRebuilt,
                            sql::kKeepOneGeneration,
                            sql::kDropGeneration}) {
        const std::string lines = plan(sql);
        EXPECT_EQ(lines.find("SCAN"), std::string::npos) << sql << "\n" << lines;
        EXPECT_EQ(lines.find("TEMP B-TREE"), std::string::npos) << sql << "\n" << lines;
    }
}

TEST_F(SqlitePlanTest, PagesSeekTheirStart) {
    EXPECT_NE(plan(sql::kListShapes).find("shape_by_collection (collection_id=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kListShapes);
    EXPECT_NE(plan(sql::kListShapesInState).find("shape_by_state (collection_id=? AND state=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kListShapesInState);
    EXPECT_NE(plan(sql::kLoadIndex).find("shape_by_collection (collection_id=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kLoadIndex);
    EXPECT_NE(plan(sql::kRebuildBatch).find("shape_by_collection (collection_id=? AND rowid>?)"),
              std::string::npos)
        << plan(sql::kRebuildBatch);
    EXPECT_NE(plan(sql::kNextJob).find("job_by_state (state=?)"), std::string::npos) << plan(sql::kNextJob);
}

// A check that can fail: an index taken away shows.
TEST_F(SqlitePlanTest, AMissingIndexWouldShow) {
    connection_.execute("DROP INDEX job_by_state");
    EXPECT_NE(plan(sql::kNextJob).find("SCAN"), std::string::npos) << plan(sql::kNextJob);
}

}  // namespace
}  // namespace shapedb::store
