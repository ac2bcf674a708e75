// SPDX-License-Identifier: GPL-3.0-or-later
// What no client could have stored is refused in a file, and told of a database: each column with its table,
// row and value.
#include <array>
#include <string>
#include <vector>

#include "server/store/parameters_codec.h"
#include "server/store/sqlite/check.h"
#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/sequences.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

struct Attack {
    const char* sql;
    const char* says;
};

const std::vector<Attack> kAttacks = {
    {"UPDATE collection SET name = '../x'",
     "table collection, row 1 has a name that is none, '../x': only letters"},
    {"UPDATE collection SET name = 'a' || char(27) || '[2J'",
     "table collection, row 1 has a name that is none, 'a\\u001b[2J': only letters"},
    {"UPDATE collection SET name = '.hidden'", "table collection, row 1 has a name that is none, '.hidden'"},
    {"UPDATE collection SET name = printf('%0200d', 1)", "200 bytes, at most 128 are allowed"},
    {"UPDATE collection SET description = printf('%02000d', 1)", "row 1 has a description that is none"},
    {"UPDATE collection SET description = CAST(x'ff' AS TEXT)", "not valid UTF-8"},
    {"UPDATE collection SET parameters = '{}'",
     "table collection, row 1 has a parameters that is none, '{}'"},
    {"UPDATE collection SET created_at = -1", "row 1 has a created_at that is none, '-1': outside 0 to"},
    {"UPDATE collection SET created_at = 9000000000000000", "row 1 has a created_at that is none"},
    {"UPDATE collection_alias SET name = 'a b'",
     "table collection_alias, row 1 has a name that is none, 'a b'"},
    {"UPDATE shape SET key = 'a' || char(10) WHERE id = 1",
     "table shape, row 1 has a key that is none, 'a\\u000a'"},
    {"UPDATE shape SET key = 'a' || char(917505) WHERE id = 1",
     "table shape, row 1 has a key that is none, 'a\\udb40\\udc01'"},
    {"UPDATE shape SET key = 'a' || char(8204) WHERE id = 1", "has a key that is none, 'a\\u200c'"},
    {"UPDATE shape SET origin_x = 1e12 WHERE id = 1", "shape 'a': origin: coordinates up to 1e+12 are"},
    {"UPDATE shape SET origin_y = 1e38 WHERE id = 1", "shape 'a': origin: coordinates up to 1e+38 are"},
    {"PRAGMA ignore_check_constraints=ON; UPDATE shape SET origin_z = -9e999 WHERE id = 1", ""},
    {"UPDATE shape SET version = 4611686018427387903 WHERE id = 1",
     "table shape, row 1 has a version that is none, '4611686018427387903': outside 1 to 2^60"},
    {"PRAGMA ignore_check_constraints=ON; UPDATE shape SET version = -3, points_version = -3 WHERE id = 1",
     ""},
    {"PRAGMA ignore_check_constraints=ON; UPDATE shape SET state = 7 WHERE id = 1", ""},
    {"PRAGMA ignore_check_constraints=ON; UPDATE shape SET point_count = -1 WHERE id = 1", ""},
    {"UPDATE shape SET updated_at = -5 WHERE id = 1",
     "table shape, row 1 has a updated_at that is none, '-5'"},
    {"UPDATE shape SET failure_code = 'no such' WHERE state = 2",
     "has a failure_code that is none, 'no such'"},
    {"UPDATE shape SET failure_message = CAST(x'c3' AS TEXT) WHERE state = 2",
     "has a failure_message that is none"},
    {"UPDATE shape_metadata SET name = 'n' || char(155)",
     "table shape_metadata, row 1 has a name that is none"},
    {"UPDATE shape_metadata SET name = ''", "table shape_metadata, row 1 has a name that is none, ''"},
    {"UPDATE shape_metadata SET value = printf('%01025d', 1)",
     "table shape_metadata, row 1 has a value that is none"},
    {"UPDATE shape_metadata SET value = CAST(x'80' AS TEXT)",
     "table shape_metadata, row 1 has a value that is none"},
    {"WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 65) INSERT INTO "
     "shape_metadata SELECT "
     "1, 'm' || i, '' FROM n",
     "has more than 64 entries of metadata"},
    {"UPDATE job SET queued_at = -1", "table job, row 3 has a queued_at that is none, '-1'"},
    {"UPDATE job SET stops = 4611686018427387904", "table job, row 3 has a stops that is none"},
    {"UPDATE job SET state = 1", "table job, row 3 is running and was never tried"},
    {"UPDATE rebuild SET total = -1", "table rebuild, row 1 has a total that is none, '-1'"},
    {"UPDATE rebuild SET parameters = '{}'", "table rebuild, row 1 has a parameters that is none, '{}'"},
    {"UPDATE rebuild SET target_generation = 9",
     "table rebuild, row 1 runs into a generation that is not the next"},
    {"UPDATE rebuild_failure SET code = 'x'", "table rebuild_failure, row 1 has a code that is none, 'x'"},
    {"UPDATE deleted_shape SET key = ''", "table deleted_shape, row 1 has a key that is none, ''"},
    {"UPDATE deleted_shape SET metadata = '{\"a b\": \"\"}'",
     "table deleted_shape, row 1 has a name that is none, 'a b'"},
    {"UPDATE deleted_shape SET id = 9223372036854775807", "has a id that is none"},
    {"INSERT INTO notice VALUES (1, 1, 1, CAST(x'ff' AS TEXT))",
     "table notice, row 1 has a message that is none"},
    {"UPDATE tally SET commits = 4611686018427387904", "table tally, row 1 has a commits that is none"},
    {"UPDATE sqlite_sequence SET seq = 4611686018427387904 WHERE name = 'shape'",
     "the id sequence of table shape stands at 4611686018427387904, outside 0 to 2^60"},
    {"UPDATE sqlite_sequence SET seq = 4611686018427387000 WHERE name = 'job'",
     "the id sequence of table job"},
    {"UPDATE sqlite_sequence SET seq = -1 WHERE name = 'rebuild'", "the id sequence of table rebuild"},
};

class ValueRulesTest : public StoreTest {
  protected:
    void SetUp() override {
        open();
        fill();
    }

    void open() {
        store_.reset();
        auto opened = openSqliteStore(withParameters());
        ASSERT_TRUE(opened) << opened.error().message;
        store_ = std::move(*opened);
    }
    SqliteOptions withParameters() const {
        SqliteOptions strict = options();
        strict.acceptParameters = [](const std::string& text) -> Result<void> {
            const auto decoded = decodeParameters(text);
            if (!decoded) return fail(decoded.error());
            return {};
        };
        return strict;
    }

    /// A row in each table.
    void fill() {
        const std::string parameters = encodeParameters(parametersOf(Profile::kPaper));
        const Collection c = store_->createCollection("parts", "all of them", parameters).value();
        ASSERT_TRUE(store_->setAlias("alias", c.id));
        put(c.id, "a", 1, {{"n", "1"}});
        finishAll();
        put(c.id, "b", 2);
        ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kNoInterior, "no closed interior"}));
        const Rebuild rebuild = store_->startRebuild(c.id, parameters).value();
        ASSERT_TRUE(store_->putRebuildFailure(rebuild.id, 1, 1, {ErrorCode::kNoInterior, "no"}));
        put(c.id, "c", 3);
        put(c.id, "d", 4, {{"n", "2"}});
        ASSERT_TRUE(store_->deleteShape(c.id, "d", 1));
        expectSound();
    }

    void change(const std::string& path, const std::string& sql) const {
        SqliteConnection(path, OpenMode::kReadWrite, 1'000).execute(sql);
    }
};

TEST_F(ValueRulesTest, AFileThatBreaksOneIsNotRestored) {
    const auto before = store_->listShapes(1, 0, 10, {}).value();
    const std::string good = folder_.file("good");
    ASSERT_TRUE(store_->backup(good, {}));
    for (const Attack& attack : kAttacks) {
        SCOPED_TRACE(attack.sql);
        const std::string path = folder_.file("bad");
        spill(path, slurp(good));
        change(path, attack.sql);
        const auto restored = store_->restore(path, {}, {});
        ASSERT_FALSE(restored);
        EXPECT_EQ(restored.error().code, ErrorCode::kMalformedFile);
        EXPECT_NE(restored.error().message.find(attack.says), std::string::npos) << restored.error().message;
        EXPECT_EQ(store_->listShapes(1, 0, 10, {}).value(), before);
    }
    expectSound();
    EXPECT_TRUE(store_->restore(good, {}, {})) << "the file itself is good";
}

TEST_F(ValueRulesTest, NorImported) {
    const std::string good = folder_.file("good");
    ASSERT_TRUE(store_->exportCollection(1, good, {}));
    ImportRequest as;
    as.name = "copy";
    for (const Attack& attack : kAttacks) {
        SCOPED_TRACE(attack.sql);
        // An export has no aliases, rebuilds, deletions; the one job has another id.
        const std::string sql = attack.sql;
        if (sql.find("alias") != std::string::npos || sql.find("rebuild") != std::string::npos ||
            sql.find("deleted") != std::string::npos)
            continue;
        const std::string path = folder_.file("bad");
        spill(path, slurp(good));
        change(path, sql);
        EXPECT_FAILS(store_->importCollection(path, as, {}), ErrorCode::kMalformedFile);
        EXPECT_EQ(store_->listCollections()->size(), 1u);
    }
    EXPECT_TRUE(store_->importCollection(good, as, {}));
}

TEST_F(ValueRulesTest, ADatabaseThatBreaksOneIsTold) {
    store_.reset();
    const std::string whole = slurp(options().path);
    for (const Attack& attack : kAttacks) {
        SCOPED_TRACE(attack.sql);
        store_.reset();
        spill(options().path, whole);
        for (const char* ending : {".commits", ".lock"}) std::filesystem::remove(options().path + ending);
        change(options().path, attack.sql);
        open();
        const auto problems = store_->check({}).value();
        EXPECT_FALSE(problems.empty());
        std::string all;
        for (const std::string& problem : problems) all += problem + "\n";
        std::string says = attack.says;
        // A running database may have counted further than a file may.
        says = says.substr(0, says.find("2^60"));
        // Mended at the start.
        says = says.substr(0, says.find(" stands at"));
        EXPECT_NE(all.find(says), std::string::npos) << all;
    }
}

TEST_F(ValueRulesTest, NamesAreToldAtTheStart) {
    store_.reset();
    change(options().path, "UPDATE collection SET name = '../x'");
    open();
    ASSERT_EQ(store_->findings().size(), 1u);
    EXPECT_NE(store_->findings()[0].find("'../x'"), std::string::npos);
    EXPECT_EQ(store_->check({})->size(), 1u) << "told once";
}

// A column that a later migration adds needs a rule too.
TEST_F(ValueRulesTest, EveryColumnHasOne) {
    ASSERT_TRUE(store_->checkpoint());
    store_.reset();
    change(options().path, "INSERT INTO notice VALUES (1, 1, 1, 'found')");
    std::vector<std::array<std::string, 3>> columns;
    {
        SqliteConnection connection(options().path, OpenMode::kReadOnly, 1'000);
        Query query(
            connection,
            "SELECT t.name, c.name, c.type FROM sqlite_schema t JOIN pragma_table_info(t.name) c WHERE "
            "t.type = 'table' "
            "AND t.name <> 'schema_migration' AND t.name <> 'sqlite_sequence'");
        while (query.step()) columns.push_back({query.text(0), query.text(1), query.text(2)});
    }
    EXPECT_GT(columns.size(), 70u);
    const std::string path = folder_.file("absurd");
    for (const auto& [table, column, type] : columns) {
        int refused = 0;
        for (const char* value :
             {"9000000000000000000", "-9000000000000000000", "9e999", "CAST(x'ff' AS TEXT)", "x'ff'"}) {
            SCOPED_TRACE(table + "." + column + " = " + value);
            spill(path, slurp(options().path));
            try {
                change(path,
                       "PRAGMA foreign_keys=OFF; PRAGMA ignore_check_constraints=ON; UPDATE OR IGNORE " +
                           table + " SET " + column + " = " + value);
            } catch (const Failure&) {
                continue;  // SQLite's types refuse it
            }
            SqliteConnection connection(path, OpenMode::kReadOnly, 1'000);
            const auto problems =
                checkDatabase(connection, {kMostCounted, withParameters().acceptParameters}, {});
            refused += problems.empty() ? 0 : 1;
            // Among the texts and the real numbers some of these are good.
            if (type == "INTEGER") {
                EXPECT_FALSE(problems.empty());
            }
        }
        EXPECT_GT(refused, 0) << table << "." << column;
    }
}

// What a file at the limit brings in can be changed, and a backup of it restored.
TEST_F(ValueRulesTest, ThereIsRoomAboveWhatIsAccepted) {
    const std::string path = folder_.file("far");
    ASSERT_TRUE(store_->backup(path, {}));
    const std::string most = std::to_string(kMostCountedInFiles);
    change(path, "UPDATE sqlite_sequence SET seq = " + most);
    ASSERT_TRUE(store_->restore(path, {}, {}));
    const Shape added = put(1, "new", 9);
    EXPECT_EQ(added.id, kMostCountedInFiles + 1);
    expectSound();
}

// A standby that restores what it had restored before: ids must not double each time.
TEST_F(ValueRulesTest, RestoringOverAndOverUsesUpNoIds) {
    for (int round = 0; round < 80; ++round) {
        const std::string path = folder_.file("round");
        std::filesystem::remove(path);
        ASSERT_TRUE(store_->backup(path, {}));
        const auto restored = store_->restore(path, {}, {});
        ASSERT_TRUE(restored) << round << ": " << restored.error().message;
    }
    expectSound();
    EXPECT_LT(claim().id, 1'000);
}

}  // namespace
}  // namespace shapedb::store
