// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "server/store/sqlite/migrator.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class SqliteMaintenanceTest : public StoreTest {
  protected:
    void SetUp() override {
        StoreTest::SetUp();
        collection_ = collection();
        for (int i = 0; i < 6; ++i) put(collection_.id, "k" + std::to_string(i), 10 + i, {{"label", "cup"}});
        for (int i = 0; i < 4; ++i) {
            const Job job = claim();
            ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
        }
        ASSERT_TRUE(store_->backup(backup_, {}));
    }

    void expectRefused(const std::string& path, ErrorCode code, const std::string& says = {}) {
        const Shape before = put(collection_.id, "live", 99);
        const auto refused = store_->restore(path, {}, {});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, code) << refused.error().message;
        EXPECT_NE(refused.error().message.find(says), std::string::npos) << refused.error().message;
        // The database that runs is not damaged.
        EXPECT_EQ(refused.error().message.find("admin check"), std::string::npos) << refused.error().message;
        EXPECT_TRUE(store_->getShape(collection_.id, "live").value() == before);
        EXPECT_FALSE(std::filesystem::exists(folder_.file("shapes.db.restore")));
        expectSound();
    }

    /// A copy of the backup, changed by SQL.
    std::string changed(const std::string& sql) {
        const std::string path = folder_.file("changed.db");
        spill(path, slurp(backup_));
        SqliteConnection(path, OpenMode::kReadWrite, 0).execute(sql);
        return path;
    }

    Collection collection_;
    std::string backup_ = folder_.file("backup.db");
};

TEST_F(SqliteMaintenanceTest, BackupIsASingleFile) {
    EXPECT_FAILS(store_->backup(backup_, {}), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->backup(folder_.file("none/x.db"), {}), ErrorCode::kFileNotWritable);
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.file(""))) {
        files += entry.path().filename().string().rfind("backup", 0) == 0 ? 1 : 0;
    }
    EXPECT_EQ(files, 1u);
    SqliteOptions other = options();
    other.path = folder_.file("opened.db");
    spill(other.path, slurp(backup_));
    auto opened = openSqliteStore(other);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ((*opened)->countShapes(collection_.id, {}).value(), 6u);
    EXPECT_TRUE((*opened)->check({})->empty());
}

TEST_F(SqliteMaintenanceTest, RefusesBadBackups) {
    expectRefused(folder_.file("missing.db"), ErrorCode::kFileNotReadable);
    expectRefused(folder_.file("."), ErrorCode::kFileNotReadable);
    const std::string path = folder_.file("bad.db");
    const std::string noBackup = "'" + path + "' is no backup of ShapeDB";
    for (const std::string& bytes : {std::string(), std::string("ply\n"), std::string(10000, 'x')}) {
        spill(path, bytes);
        expectRefused(path, ErrorCode::kMalformedFile, noBackup);
    }
    spill(path, slurp(backup_).substr(0, 40000));
    expectRefused(path, ErrorCode::kMalformedFile, "cannot be restored: ");
    spill(path, slurp(backup_));
    spill(path + "-wal", "in use");
    expectRefused(path, ErrorCode::kMalformedFile);
    expectRefused(folder_.file("shapes.db"), ErrorCode::kMalformedFile);
    expectRefused(changed("PRAGMA application_id=1"), ErrorCode::kMalformedFile, "is no backup of ShapeDB");
    const std::string next = std::to_string(embeddedMigrations().size() + 1);
    expectRefused(changed("PRAGMA user_version=" + next), ErrorCode::kSchemaTooNew);
    expectRefused(changed("INSERT INTO schema_migration VALUES (" + next +
                          ", 'future', '', 0); PRAGMA user_version=" + next),
                  ErrorCode::kSchemaTooNew);
    expectRefused(changed("UPDATE schema_migration SET sha256 = 'x'"), ErrorCode::kMalformedFile);
    expectRefused(changed("DROP INDEX job_by_state"), ErrorCode::kMalformedFile);
    expectRefused(changed("CREATE TABLE more (x)"), ErrorCode::kMalformedFile);
    expectRefused(changed("UPDATE shape_points SET points = zeroblob(97) WHERE shape_id = 3"),
                  ErrorCode::kMalformedFile);
    expectRefused(changed("DELETE FROM signature"), ErrorCode::kMalformedFile);
}

TEST_F(SqliteMaintenanceTest, RefusesAnotherPageSize) {
    expectRefused(changed("PRAGMA page_size=8192; VACUUM"), ErrorCode::kMalformedFile);
}

// Found by fuzzing: SQLite takes an unknown encoding for UTF-8 where it opens the file anew, and refuses it
// on connections that are open, so that nothing could be read after such a restore.
TEST_F(SqliteMaintenanceTest, AnotherEncodingOfTextsIsRefused) {
    for (const char encoding : {'\0', '\2', '\3', 'd'}) {
        std::string bytes = slurp(backup_);
        bytes[59] = encoding;
        const std::string path = folder_.file("encoded.db");
        spill(path, bytes);
        expectRefused(path, ErrorCode::kMalformedFile, "encoding of texts");
    }
}

TEST_F(SqliteMaintenanceTest, RestoreReportsHowMuchOfTheFileItHasCopied) {
    for (int i = 0; i < 8; ++i) {
        const auto big = cloud(200 + i, 20000);
        ASSERT_TRUE(store_->putShape(request(collection_.id, "big" + std::to_string(i), big)));
    }
    const std::string large = folder_.file("large.db");
    ASSERT_TRUE(store_->backup(large, {}));
    const std::uint64_t size = std::filesystem::file_size(large);
    std::vector<std::uint64_t> copied;
    RunContext context;
    context.progress = [&](const std::string& stage, std::uint64_t done, std::uint64_t total) {
        if (stage != "copy") return;
        EXPECT_EQ(total, size);
        copied.push_back(done);
    };
    ASSERT_TRUE(store_->restore(large, context, {}));
    ASSERT_GT(copied.size(), 2u) << "the file is to be longer than one piece";
    EXPECT_TRUE(std::is_sorted(copied.begin(), copied.end()));
    EXPECT_EQ(copied.front(), 0u);
    EXPECT_EQ(copied.back(), size);
}

// Breaks each rule of the check.
TEST_F(SqliteMaintenanceTest, CheckFindsDamage) {
    const std::pair<const char*, const char*> breaks[] = {
        {"UPDATE shape_points SET points = zeroblob(97) WHERE shape_id = 1", "checksum"},
        {"UPDATE shape_points SET points = x'01' WHERE shape_id = 1", "damaged"},
        {"UPDATE shape SET point_count = 9 WHERE id = 1", "damaged"},
        {"UPDATE shape SET point_count = 4611686018427387904 WHERE id = 1", "point count"},
        {"DELETE FROM shape_points WHERE shape_id = 1", "are missing"},
        {"UPDATE shape_points SET stored_bytes = 1 WHERE shape_id = 1", "byte counts"},
        {"DELETE FROM signature WHERE shape_id = 1", "is ready but"},
        {"UPDATE signature SET bytes = x'00' WHERE shape_id = 1", "signature of shape 'k0'"},
        {"UPDATE signature SET generation = 5 WHERE shape_id = 1", "no generation"},
        {"UPDATE shape SET state = 2, failure_code = 'x', failure_message = '' WHERE id = 1", "still serves"},
        {"DELETE FROM job WHERE shape_id = 5", "has no job"},
        {"UPDATE shape SET state = 1 WHERE id = 5", "not pending"},
        {"UPDATE job SET points_version = 2 WHERE shape_id = 5", "no longer has"},
        {"UPDATE tally SET jobs = jobs + 1", "tally"},
        {"PRAGMA foreign_keys=OFF; DELETE FROM shape WHERE id = 1", "missing row"},
    };
    for (const auto& [sql, expected] : breaks) {
        SqliteOptions broken = options();
        broken.path = changed(sql);
        const auto problems = openSqliteStore(broken).value()->check({}).value();
        std::string all;
        for (const auto& line : problems) all += line + "\n";
        EXPECT_NE(all.find(expected), std::string::npos) << sql << "\n" << all;
    }
}

}  // namespace
}  // namespace shapedb::store
