// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/migrator.h"

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

constexpr Migration kFirst{1, "0001_first", "CREATE TABLE a (x INTEGER); INSERT INTO a VALUES (7);"};
constexpr Migration kSecond{2, "0002_second",
                            "CREATE TABLE b (y INTEGER); INSERT INTO b SELECT x + 1 FROM a;"};

class MigratorTest : public ::testing::Test {
  protected:
    ErrorCode refusal(const std::vector<Migration>& migrations) {
        try {
            migrate(*connection_, migrations, 5);
        } catch (const Failure& failure) {
            message_ = failure.error.message;
            return failure.error.code;
        }
        ADD_FAILURE() << "not refused";
        return ErrorCode::kInternal;
    }

    Folder folder_;
    std::unique_ptr<SqliteConnection> connection_ =
        std::make_unique<SqliteConnection>(folder_.file("m.db"), OpenMode::kReadWriteCreate, 0);
    std::string message_;
};

TEST_F(MigratorTest, AppliesEachOnceInOrder) {
    EXPECT_EQ(identify(*connection_), FileKind::kEmpty);
    migrate(*connection_, {kFirst}, 5);
    EXPECT_EQ(schemaVersion(*connection_), 1);
    EXPECT_EQ(identify(*connection_), FileKind::kOurs);
    migrate(*connection_, {kFirst, kSecond}, 6);
    migrate(*connection_, {kFirst, kSecond}, 7);
    EXPECT_EQ(schemaVersion(*connection_), 2);
    EXPECT_EQ(connection_->integer("SELECT sum(y) FROM b"), 8);
    EXPECT_EQ(connection_->text("SELECT group_concat(number || name || applied_at || length(sha256)) "
                                "FROM schema_migration"),
              "10001_first564,20002_second664");
    EXPECT_EQ(connection_->integer("PRAGMA application_id"), kApplicationId);
}

TEST_F(MigratorTest, RefusesAnEditedMigration) {
    migrate(*connection_, {kFirst}, 5);
    EXPECT_EQ(refusal({{1, "0001_first", "CREATE TABLE a (x INTEGER); INSERT INTO a VALUES (8);"}}),
              ErrorCode::kDataLoss);
    EXPECT_NE(message_.find("0001_first"), std::string::npos) << message_;
}

TEST_F(MigratorTest, RefusesANewerSchema) {
    migrate(*connection_, {kFirst, kSecond}, 5);
    EXPECT_EQ(refusal({kFirst}), ErrorCode::kSchemaTooNew);
    EXPECT_NE(message_.find("schema version 2"), std::string::npos) << message_;
    connection_->execute("PRAGMA user_version=1");
    EXPECT_EQ(refusal({kFirst}), ErrorCode::kSchemaTooNew) << "the record knows better";
    connection_->execute("PRAGMA user_version=-1");
    EXPECT_EQ(refusal({kFirst, kSecond}), ErrorCode::kSchemaTooNew);
}

TEST_F(MigratorTest, RefusesADamagedRecord) {
    migrate(*connection_, {kFirst, kSecond}, 5);
    connection_->execute("DELETE FROM schema_migration WHERE number = 1");
    EXPECT_EQ(refusal({kFirst, kSecond}), ErrorCode::kDataLoss);
}

TEST_F(MigratorTest, RefusesForeignObjects) {
    migrate(*connection_, {kFirst}, 5);
    connection_->execute("CREATE TRIGGER spy AFTER INSERT ON a BEGIN DELETE FROM a; END");
    EXPECT_EQ(refusal({kFirst}), ErrorCode::kDataLoss);
    EXPECT_NE(message_.find("trigger spy"), std::string::npos) << message_;
    connection_->execute("DROP TRIGGER spy; DROP TABLE a");
    EXPECT_EQ(refusal({kFirst}), ErrorCode::kDataLoss);
    connection_->execute("CREATE TABLE a (x TEXT)");
    EXPECT_EQ(refusal({kFirst}), ErrorCode::kDataLoss);
}

TEST_F(MigratorTest, KeepsEarlierMigrationsWhenOneFails) {
    const Migration broken{2, "0002_broken", "CREATE TABLE b (y INTEGER); INSERT INTO nowhere VALUES (1);"};
    EXPECT_THROW(migrate(*connection_, {kFirst, broken}, 5), Failure);
    EXPECT_EQ(schemaVersion(*connection_), 1);
    EXPECT_EQ(connection_->integer("SELECT count(*) FROM sqlite_schema WHERE name = 'b'"), 0);
    migrate(*connection_, {kFirst, kSecond}, 5);
    EXPECT_EQ(schemaVersion(*connection_), 2);
}

TEST_F(MigratorTest, RecognisesForeignFiles) {
    connection_->execute("CREATE TABLE theirs (x)");
    EXPECT_EQ(identify(*connection_), FileKind::kForeign);
}

}  // namespace
}  // namespace shapedb::store
