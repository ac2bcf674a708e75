// SPDX-License-Identifier: GPL-3.0-or-later
// Deletions of collections: in pieces when there is much to delete.
#include <atomic>
#include <thread>

#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/migrator.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class SqliteDeletionTest : public StoreTest {
  protected:
    /// More than one transaction deletes; pending.
    Collection large(const std::string& name, int shapes = 600) {
        const Collection made = collection(name);
        for (int i = 0; i < shapes; ++i) put(made.id, std::to_string(i), static_cast<std::uint64_t>(i));
        return made;
    }
    std::int64_t rows(const std::string& table) {
        return SqliteConnection(options().path, OpenMode::kReadOnly, 1'000)
            .integer("SELECT count(*) FROM " + table);
    }
};

TEST_F(SqliteDeletionTest, OfALargeCollectionLeavesNothing) {
    const Collection gone = large("gone");
    ASSERT_TRUE(store_->setAlias("other-name", gone.id));
    const Collection kept = collection("kept");
    put(kept.id, "a", 1);
    const std::int64_t pages =
        SqliteConnection(options().path, OpenMode::kReadOnly, 1'000).integer("PRAGMA page_count");
    bool called = false;
    ASSERT_TRUE(store_->deleteCollection(gone.id, [&] { called = true; }));
    EXPECT_TRUE(called);
    EXPECT_EQ(store_->listCollections()->size(), 1u);
    EXPECT_TRUE(store_->listAliases()->empty());
    for (const char* table : {"shape", "shape_points", "job", "collection"})
        EXPECT_EQ(rows(table), 1) << table;
    EXPECT_FAILS(store_->deleteCollection(gone.id), ErrorCode::kNotFound);
    EXPECT_GT(pages, 0);
    expectSound();
}

// Nobody meets a half of it.
TEST_F(SqliteDeletionTest, IsSeenAtOnce) {
    const Collection gone = large("gone");
    ASSERT_TRUE(store_->startRebuild(gone.id, "others"));
    ASSERT_TRUE(store_->deleteCollection(gone.id, [&] {
        // Another connection, in the middle of it.
        SqliteConnection others(options().path, OpenMode::kReadOnly, 1'000);
        EXPECT_GT(others.integer("SELECT count(*) FROM shape"), 0) << "rows are left";
        EXPECT_EQ(others.integer("SELECT count(*) FROM collection WHERE name = 'gone'"), 0);
        EXPECT_EQ(others.integer("SELECT count(*) FROM rebuild WHERE state = 0"), 0);
        EXPECT_TRUE(store_->listCollections()->empty());
        EXPECT_EQ(store_->stats()->shapesPending, 0u);
        EXPECT_FALSE(store_->claimJob().value()) << "nothing of it is segmented any more";
        EXPECT_FAILS(store_->putShape(request(gone.id, "new", cloud(1))), ErrorCode::kNotFound);
        EXPECT_FAILS(store_->loadIndex(gone.id, 0, 10), ErrorCode::kNotFound);
        EXPECT_TRUE(store_->createCollection("gone", "", "")) << "the name is free";
    }));
    EXPECT_EQ(store_->listCollections()->size(), 1u);
    expectSound();
}

TEST_F(SqliteDeletionTest, IsCompletedAtTheNextStartAndLeftOutOfRestores) {
    const Collection gone = large("gone");
    std::string database;
    std::string log;
    std::string mark;
    const std::string backup = folder_.file("backup");
    ASSERT_TRUE(store_->deleteCollection(gone.id, [&] {
        EXPECT_TRUE(store_->backup(backup, {}));
        database = slurp(options().path);
        log = slurp(options().path + "-wal");
        mark = slurp(options().path + ".commits");
    }));
    // As a process that was killed in between leaves it.
    store_.reset();
    spill(options().path, database);
    spill(options().path + "-wal", log);
    std::filesystem::remove(options().path + "-shm");
    spill(options().path + ".commits", mark);
    ASSERT_GT(rows("shape"), 0);
    open();
    EXPECT_EQ(rows("shape"), 0);
    EXPECT_EQ(rows("collection"), 0);
    expectSound();
    ASSERT_TRUE(store_->restore(backup, {}, {}));
    EXPECT_EQ(rows("shape"), 0);
    expectSound();
}

TEST_F(SqliteDeletionTest, NoTransactionOfItOutgrowsTheReserve) {
    const Collection gone = large("gone", 3'000);
    ASSERT_TRUE(store_->checkpoint());
    std::atomic<bool> done{false};
    std::uintmax_t largest = 0;
    std::thread watching([&] {
        std::error_code error;
        while (!done) largest = std::max(largest, std::filesystem::file_size(options().path + "-wal", error));
    });
    ASSERT_TRUE(store_->deleteCollection(gone.id));
    done = true;
    watching.join();
    EXPECT_LT(largest, std::uintmax_t{16} << 20);
}

}  // namespace
}  // namespace shapedb::store
