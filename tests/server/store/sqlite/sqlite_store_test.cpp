// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/sqlite_store.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>

#include <sys/resource.h>

#include "server/store/sqlite/migrator.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

using SqliteStoreTest = StoreTest;

TEST_F(SqliteStoreTest, CollectionsCreateGetListDelete) {
    const Collection b = collection("b");
    const Collection a = collection("a");
    EXPECT_EQ(a.generation, 1);
    EXPECT_EQ(a.parameters, "parameters of a");
    EXPECT_FAILS(store_->createCollection("a", "", ""), ErrorCode::kAlreadyExists);
    EXPECT_EQ(store_->getCollection("b")->id, b.id);
    EXPECT_FAILS(store_->getCollection("c"), ErrorCode::kNotFound);
    const auto all = store_->listCollections().value();
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].name, "a");
    EXPECT_EQ(all[1].name, "b");

    put(a.id, "x", 1, {{"label", "cup"}});
    put(b.id, "x", 2);
    ASSERT_TRUE(store_->startRebuild(a.id, "new"));
    ASSERT_TRUE(store_->deleteCollection(a.id));
    EXPECT_FAILS(store_->deleteCollection(a.id), ErrorCode::kNotFound);
    EXPECT_EQ(store_->queueDepth()->jobs, 1u);
    EXPECT_EQ(store_->queueDepth()->bytes, 8 * 12u);
    EXPECT_TRUE(store_->runningRebuilds()->empty());
    const Collection again = collection("a");
    EXPECT_GT(again.id, a.id) << "ids are never reused";
    EXPECT_EQ(store_->countShapes(again.id, {}).value(), 0u);
    expectSound();
}

TEST_F(SqliteStoreTest, StatsCountEverything) {
    const Collection c = collection();
    const auto big = cloud(1, 1000);
    ASSERT_TRUE(store_->putShape(request(c.id, "ready", big)));
    finishAll();
    put(c.id, "failed", 2);
    ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kCoplanar, "flat"}));
    put(c.id, "pending", 3);
    const StoreStats stats = store_->stats().value();
    EXPECT_EQ(stats.collections, 1u);
    EXPECT_EQ(stats.shapesReady, 1u);
    EXPECT_EQ(stats.shapesFailed, 1u);
    EXPECT_EQ(stats.shapesPending, 1u);
    EXPECT_EQ(stats.signatures, 1u);
    EXPECT_EQ(stats.pointBytes, 1016 * 12u);
    EXPECT_GT(stats.storedPointBytes, 0u);
    EXPECT_LT(stats.storedPointBytes, stats.pointBytes);
    EXPECT_GT(stats.databaseBytes, 0u);
    EXPECT_GT(stats.walBytes, 0u);
    EXPECT_EQ(stats.schemaVersion, static_cast<int>(embeddedMigrations().size()));
    ASSERT_TRUE(store_->checkpoint());
    EXPECT_EQ(store_->stats()->walBytes, 0u);
}

TEST_F(SqliteStoreTest, TheLockFollowsNoLink) {
    const std::string path = folder_.file("other.db"), foreign = folder_.file("foreign");
    for (const bool dangling : {false, true}) {
        if (!dangling) std::ofstream(foreign) << "somebody else's";
        std::filesystem::create_symlink(foreign, path + ".lock");
        SqliteOptions own = options();
        own.path = path;
        const auto store = openSqliteStore(own);
        ASSERT_FALSE(store);
        EXPECT_NE(store.error().message.find("symbolic link"), std::string::npos) << store.error().message;
        EXPECT_EQ(std::filesystem::exists(foreign), !dangling);
        if (!dangling) {
            EXPECT_EQ(std::filesystem::file_size(foreign), 15u);
        }
        std::filesystem::remove(path + ".lock");
        std::filesystem::remove(foreign);
    }
}

// Else two stores, each with a lock beside its own link, would have one database open.
TEST_F(SqliteStoreTest, TheDatabaseIsNoLink) {
    const std::string path = folder_.file("link.db");
    for (const std::string& target : {options().path, folder_.file("nowhere.db")}) {
        std::filesystem::create_symlink(target, path);
        SqliteOptions own = options();
        own.path = path;
        const auto store = openSqliteStore(own);
        ASSERT_FALSE(store) << target;
        EXPECT_EQ(store.error().code, ErrorCode::kStorage);
        EXPECT_NE(store.error().message.find("symbolic link"), std::string::npos) << store.error().message;
        std::filesystem::remove(path);
    }
    EXPECT_FALSE(std::filesystem::exists(folder_.file("nowhere.db")));
}

TEST_F(SqliteStoreTest, OneProcessAtATime) {
    const auto second = openSqliteStore(options());
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kStorage);
    EXPECT_NE(second.error().message.find(std::to_string(getpid())), std::string::npos)
        << second.error().message;
    store_.reset();
    EXPECT_TRUE(openSqliteStore(options()));
}

TEST_F(SqliteStoreTest, RefusesBadOptions) {
    const auto refused = [&](auto change) {
        SqliteOptions bad = options();
        bad.path = folder_.file("other.db");
        change(bad);
        return openSqliteStore(bad);
    };
    EXPECT_FAILS(refused([](auto& o) { o.path.clear(); }), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(refused([](auto& o) { o.readers = 0; }), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(refused([](auto& o) { o.readers = 65; }), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(refused([](auto& o) { o.busyTimeoutMs = -1; }), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(refused([](auto& o) { o.pointCompressionLevel = 20; }), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(refused([&](auto& o) { o.path = folder_.file("missing/x.db"); }), ErrorCode::kStorage);
    EXPECT_FAILS(refused([&](auto& o) { o.path = folder_.file("."); }), ErrorCode::kStorage);
}

TEST_F(SqliteStoreTest, RefusesWhatIsNoDatabaseOfOurs) {
    SqliteOptions other = options();
    other.path = folder_.file("other.db");
    spill(other.path, "ply\nformat ascii 1.0\n" + std::string(5000, 'x'));
    EXPECT_FAILS(openSqliteStore(other), ErrorCode::kDataLoss);
    EXPECT_EQ(slurp(other.path).substr(0, 3), "ply");
    spill(other.path, "");
    EXPECT_FAILS(openSqliteStore(other), ErrorCode::kDataLoss);
    std::filesystem::remove(other.path);
    spill(other.path + "-wal", "left behind");
    EXPECT_FAILS(openSqliteStore(other), ErrorCode::kDataLoss);
    EXPECT_FALSE(std::filesystem::exists(other.path));
}

TEST_F(SqliteStoreTest, PathsAreNeverUris) {
    const auto before = std::filesystem::current_path();
    std::filesystem::current_path(folder_.file(""));
    SqliteOptions odd = options();
    odd.path = "file:odd?mode=memory";
    {
        auto opened = openSqliteStore(odd);
        ASSERT_TRUE(opened) << opened.error().message;
        ASSERT_TRUE((*opened)->createCollection("a", "", ""));
    }
    EXPECT_TRUE(std::filesystem::exists(folder_.file("file:odd?mode=memory")));
    std::filesystem::current_path(before);
}

TEST_F(SqliteStoreTest, TextKeepsEveryByte) {
    const Collection c = collection();
    const std::string odd = std::string("a\0b", 3) + "\xc3\xa9 '\"%_;--";
    put(c.id, odd, 1, {{odd, odd}, {"", ""}});
    const Shape back = store_->getShape(c.id, odd).value();
    EXPECT_EQ(back.key, odd);
    EXPECT_EQ(back.metadata, (Metadata{{odd, odd}, {"", ""}}));
}

/// While it lives, no file of this process may grow beyond `bytes`: imitates a full device without
/// root.
class FileSizeLimit {
  public:
    explicit FileSizeLimit(rlim_t bytes) {
        previous_ = std::signal(SIGXFSZ, SIG_IGN);
        getrlimit(RLIMIT_FSIZE, &before_);
        rlimit limit = before_;
        limit.rlim_cur = bytes;
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, previous_);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

  private:
    rlimit before_{};
    void (*previous_)(int);
};

TEST_F(SqliteStoreTest, FullDeviceStoresNothingAndRecovers) {
    const Collection c = collection();
    put(c.id, "before", 1);
    const auto big = cloud(2, 100000);
    {
        const FileSizeLimit limit(600000);
        const auto refused = store_->putShape(request(c.id, "big", big));
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::kStorageFull) << refused.error().message;
        EXPECT_FAILS(store_->getShape(c.id, "big"), ErrorCode::kNotFound);
        EXPECT_TRUE(store_->getShape(c.id, "before"));
        EXPECT_EQ(store_->queueDepth()->jobs, 1u);
    }
    const auto stored = store_->putShape(request(c.id, "big", big));
    ASSERT_TRUE(stored) << stored.error().message;
    EXPECT_EQ(store_->loadPoints(stored->shape.id)->xyz, big);
    expectSound();
    const FileSizeLimit limit(600000);
    EXPECT_FAILS(store_->backup(folder_.file("too-big.db"), {}), ErrorCode::kStorageFull);
    EXPECT_FALSE(std::filesystem::exists(folder_.file("too-big.db")));
}

TEST_F(SqliteStoreTest, WriteAheadLogStaysSmall) {
    const Collection c = collection();
    std::uint64_t largest = 0;
    for (std::uint64_t i = 0; i < 25; ++i) {
        const auto points = cloud(i, 100000);
        ASSERT_TRUE(store_->putShape(request(c.id, "k", points)));
        largest = std::max(largest, store_->stats()->walBytes);
    }
    EXPECT_GT(store_->stats()->databaseBytes, 1000000u);
    EXPECT_LT(largest, 17u << 20) << "25 MB were written";
}

TEST_F(SqliteStoreTest, FilesAreForTheOwnerOnly) {
    collection();
    for (const char* name : {"shapes.db", "shapes.db-wal", "shapes.db.lock"}) {
        const auto mode = std::filesystem::status(folder_.file(name)).permissions();
        EXPECT_EQ(mode & (std::filesystem::perms::group_all | std::filesystem::perms::others_all),
                  std::filesystem::perms::none)
            << name;
    }
}

TEST_F(SqliteStoreTest, WaitingShapesCostNothingHoweverManyThereAre) {
    const Collection parts = collection();
    put(parts.id, "first", 1);
    store_.reset();
    execute(
        "BEGIN; WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 100000) INSERT "
        "INTO "
        "shape (collection_id, key, version, points_version, state, point_count, checksum, created_at, "
        "updated_at, origin_x, origin_y, origin_z) SELECT s.collection_id, 'n' || i, 1, 1, 0, 8, s.checksum, "
        "1, 1, 0.0, 0.0, 0.0 FROM n, shape s "
        "WHERE s.id "
        "= 1; COMMIT");
    open();
    const auto began = std::chrono::steady_clock::now();
    for (int i = 0; i < 100; ++i) ASSERT_EQ(store_->countWaiting(parts.id).value(), 100'001u);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - began;
    EXPECT_LT(taken.count(), 0.5) << "a hundred times";
}

}  // namespace
}  // namespace shapedb::store
