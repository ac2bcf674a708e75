// SPDX-License-Identifier: GPL-3.0-or-later
// What an import refuses, and what is left when an export or import does not come to its end: nothing.
#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "core/base/return_if_error.h"
#include "server/store/sqlite/migrator.h"
#include "tests/server/store/transfer_fixture.h"

namespace shapedb::store {
namespace {

using TransferRefusalTest = TransferTest;

TEST_P(TransferRefusalTest, RefusesHostileFiles) {
    const std::string good = exported();
    const std::string path = folder_.file("bad.db");
    expectRefused(folder_.file("missing.db"), ErrorCode::kFileNotReadable);
    spill(path, std::string(10'000, 'x'));
    expectRefused(path, ErrorCode::kMalformedFile, "'" + path + "' is no export of ShapeDB");
    spill(path, "");
    expectRefused(path, ErrorCode::kMalformedFile, "is no export of ShapeDB");
    spill(path, slurp(good).substr(0, 40'960));
    expectRefused(path, ErrorCode::kMalformedFile);
    std::string damaged = slurp(good);
    for (std::size_t at = 3 * 4096; at < 4 * 4096; ++at) damaged[at] = '\x5a';
    spill(path, damaged);
    expectRefused(path, ErrorCode::kMalformedFile, "'" + path + "' cannot be imported: ");
    const auto refused = [&](const std::string& sql, ErrorCode code, const std::string& says = {}) {
        SCOPED_TRACE(sql);
        expectRefused(changed(good, sql), code, says);
    };
    refused(
        "INSERT INTO collection (name, description, parameters, generation, created_at) VALUES ('b', '', "
        "'', 1, 0)",
        ErrorCode::kMalformedFile, "2 collections");
    refused("PRAGMA foreign_keys=ON; DELETE FROM collection", ErrorCode::kMalformedFile, "no collection");
    refused("UPDATE collection SET name = '.import'", ErrorCode::kMalformedFile, "no collection");
    refused("CREATE TABLE more (x)", ErrorCode::kMalformedFile, "more");
    refused("CREATE TRIGGER t AFTER INSERT ON shape BEGIN DELETE FROM collection; END",
            ErrorCode::kMalformedFile, "trigger t");
    refused("PRAGMA application_id=1", ErrorCode::kMalformedFile);
    refused("PRAGMA user_version=" + std::to_string(embeddedMigrations().size() + 1),
            ErrorCode::kSchemaTooNew);
    refused("UPDATE sqlite_sequence SET seq = 9223372036854775807 WHERE name = 'shape'",
            ErrorCode::kMalformedFile, "sequence");
    refused("UPDATE shape SET version = 9223372036854775806 WHERE id = 1", ErrorCode::kMalformedFile, "2^62");
    refused("UPDATE shape SET key = 'a' || char(27) WHERE id = 1", ErrorCode::kMalformedFile, "key");
    refused("UPDATE signature SET bytes = x'00' WHERE shape_id = 1", ErrorCode::kMalformedFile, "damaged");
    refused("UPDATE shape_points SET points = zeroblob(97) WHERE shape_id = 3", ErrorCode::kMalformedFile);
    refused("PRAGMA page_size=8192; VACUUM", ErrorCode::kMalformedFile);
    EXPECT_TRUE(other_->listCollections()->empty());
    ASSERT_TRUE(other_->importCollection(good, as("copy"), {})) << "the file itself is good";
}

TEST_P(TransferRefusalTest, AnExportIsNotRestored) {
    const std::string exportFile = exported();
    const Collection mine = other_->createCollection("mine", "", "").value();
    ASSERT_TRUE(other_->putShape(request(mine.id, "kept", cloud(1))));
    const auto refused = other_->restore(exportFile, {}, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kMalformedFile);
    for (const char* words : {"export of one collection, 'parts'", "shapedb collection import"}) {
        EXPECT_NE(refused.error().message.find(words), std::string::npos) << refused.error().message;
    }
    EXPECT_TRUE(other_->getShape(mine.id, "kept")) << "the others are there";
    // The backup of a server that has this collection alone is one all the same.
    const std::string backup = folder_.file("whole.db");
    ASSERT_TRUE(store_->backup(backup, {}));
    ASSERT_TRUE(other_->restore(backup, {}, {}));
    EXPECT_EQ(other_->listCollections()->size(), 1u);
    // Also one of before exports, whose commits nobody had counted.
    const std::string old = folder_.file("old.db");
    {
        SqliteConnection connection(old, OpenMode::kReadWriteCreate, 0);
        migrate(connection, {embeddedMigrations().begin(), embeddedMigrations().begin() + 3}, 1);
        connection.execute(
            "INSERT INTO collection (name, description, parameters, generation, created_at) VALUES ('b', '', "
            "'', 1, 0)");
    }
    const auto restored = other_->restore(old, {}, {});
    ASSERT_TRUE(restored) << restored.error().message;
}

// A file of schema version 1 whose trigger is never done when the first migration changes the table.
TEST_P(TransferRefusalTest, AMigrationThatNeverEndsCanBeCancelled) {
    const std::string path = folder_.file("endless.db");
    const std::vector<Migration> first(embeddedMigrations().begin(), embeddedMigrations().begin() + 1);
    {
        SqliteConnection connection(path, OpenMode::kReadWriteCreate, 0);
        migrate(connection, first, 1);
        connection.execute(
            "CREATE VIEW endless AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x "
            "FROM c; CREATE TRIGGER t AFTER INSERT ON schema_migration BEGIN UPDATE tally SET jobs = (SELECT "
            "max(x) FROM endless); END");
    }
    RunContext context;
    context.deadline = RunContext::Clock::now() + std::chrono::milliseconds(300);
    EXPECT_FAILS(other_->importCollection(path, as("copy"), context), ErrorCode::kDeadlineExceeded);
    expectNothingOf("copy");
}

TEST_P(TransferRefusalTest, RefusesTakenNames) {
    const std::string path = exported();
    const Collection taken = other_->createCollection("taken", "", "").value();
    ASSERT_TRUE(other_->setAlias("alias", taken.id));
    for (const char* name : {"taken", "alias"}) {
        EXPECT_FAILS(other_->importCollection(path, as(name), {}), ErrorCode::kAlreadyExists);
    }
    ImportRequest late = as("copy");
    late.beforeVisible = [&](const Collection&) -> Result<void> {
        RETURN_IF_ERROR(other_->createCollection("copy", "", ""));
        return {};
    };
    EXPECT_FAILS(other_->importCollection(path, late, {}), ErrorCode::kAlreadyExists);
    ASSERT_TRUE(other_->deleteCollection(other_->getCollection("copy")->id));
    expectNothingOf("copy");
    EXPECT_TRUE(other_->importCollection(path, as("copy"), {}));
    expectSoundStore(*other_);
}

TEST_P(TransferRefusalTest, WhatTheCallerRefusesIsNotStored) {
    const std::string path = exported();
    const auto no = [](const auto&) { return Result<void>(fail(ErrorCode::kPermissionDenied, "no")); };
    ImportRequest request = as("copy");
    request.accept = no;
    EXPECT_FAILS(other_->importCollection(path, request, {}), ErrorCode::kPermissionDenied);
    request = as("copy");
    int shapes = 0;
    request.acceptShape = [&](const Shape&) {
        return ++shapes < kShapes ? Result<void>() : Result<void>(fail(ErrorCode::kInvalidArgument, "no"));
    };
    EXPECT_FAILS(other_->importCollection(path, request, {}), ErrorCode::kInvalidArgument);
    request = as("copy");
    request.beforeVisible = no;
    EXPECT_FAILS(other_->importCollection(path, request, {}), ErrorCode::kPermissionDenied);
    request.beforeVisible = [&](const Collection&) -> Result<void> {
        std::thread([&] {
            EXPECT_FAILS(other_->importCollection(path, as("b"), {}), ErrorCode::kRejected);
        }).join();
        return {};
    };
    EXPECT_TRUE(other_->importCollection(path, request, {}));
    ASSERT_TRUE(other_->deleteCollection(other_->getCollection("copy")->id));
    expectNothingOf("copy");
    EXPECT_EQ(other_->stats()->pointBytes, 0u);
}

TEST_P(TransferRefusalTest, ACancelledOneLeavesNothing) {
    const std::string path = exported();
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    for (const std::string stop : {"copy", "integrity", "points", "import"}) {
        cancel = false;
        context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t) {
            if (stage == stop && (done > 0 || stop != "import")) cancel = true;
        };
        EXPECT_FAILS(other_->importCollection(path, as("copy"), context), ErrorCode::kCancelled);
        expectNothingOf("copy");
        EXPECT_EQ(other_->stats()->pointBytes, 0u) << stop;
    }
    for (const std::string stop : {"export", "integrity", "points"}) {
        cancel = false;
        context.progress = [&](const char* stage, std::uint64_t, std::uint64_t) {
            if (stage == stop) cancel = true;
        };
        EXPECT_FAILS(store_->exportCollection(collection_.id, folder_.file("x"), context),
                     ErrorCode::kCancelled);
        for (const auto& entry : std::filesystem::directory_iterator(folder_.file("")))
            EXPECT_NE(entry.path().filename().string().rfind("x", 0), 0u) << entry.path();
    }
}

SHAPEDB_ON_EACH_ENGINE(TransferRefusalTest);

}  // namespace
}  // namespace shapedb::store
