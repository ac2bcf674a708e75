// SPDX-License-Identifier: GPL-3.0-or-later
// One small database per schema version, opened and queried by every later version.
// SHAPEDB_WRITE_GOLDEN=FILE writes the one of the current schema (docs/storage.md).
#include <cstdlib>
#include <filesystem>

#include "server/store/sqlite/migrator.h"
#include "tests/server/store/sqlite/golden_file.h"

namespace shapedb::store {
namespace {

using GoldenTest = StoreTest;

const std::vector<float> kTetrahedron = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};

std::vector<float> ball() { return cloud(42, 300); }
const Point3 kSite{4.4e6 + 1.0 / 3.0, -5.2e6, 120.5};

/// A ready, a replaced (pending, old signature serving), a failed and a running shape, beside
/// a rebuild in progress, an empty collection and an alias.
void fill(Store& store) {
    const Collection c = store.createCollection("golden", "one of each", "theta=20").value();
    ASSERT_TRUE(store.createCollection("empty", "", ""));
    ASSERT_TRUE(store.setAlias("gold", c.id));
    const std::vector<float> round = ball();
    const auto finish = [&] {
        const Job job = **store.claimJob();
        ASSERT_TRUE(store.finishJob(job, signatureFor(job)));
    };
    ASSERT_TRUE(store.putShape(request(c.id, "ready", kTetrahedron, {{"label", "tetrahedron"}, {"n", "4"}})));
    finish();
    ASSERT_TRUE(store.putShape(request(c.id, "replaced", kTetrahedron)));
    finish();
    ASSERT_TRUE(store.putShape(request(c.id, "failed", kTetrahedron)));
    ASSERT_TRUE(store.failJob(**store.claimJob(), {ErrorCode::kNoInterior, "no closed interior"}));
    ASSERT_TRUE(store.putShape(request(c.id, "replaced", round, {{"label", "ball"}}, kSite)));
    const Rebuild rebuild = store.startRebuild(c.id, "theta=25").value();
    ASSERT_TRUE(store.putRebuilt(rebuild.id, signatureFor(1, 1, 2)));
    ASSERT_TRUE(store.claimJob().value());
    ASSERT_TRUE(store.putShape(request(c.id, "gone", kTetrahedron, {{"label", "gone"}})));
    ASSERT_TRUE(store.deleteShape(c.id, "gone", 1));
}

class EachGoldenTest : public GoldenTest, public ::testing::WithParamInterface<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, EachGoldenTest, ::testing::Values(1, 2, 3, 4, 5, 6, 7));

/// As if no database had been in this folder.
void forgetTheOneBefore(const std::string& path) {
    for (const char* ending : {".commits", ".lock"}) std::filesystem::remove(path + ending);
}

/// The database of a schema version; empty if it is missing.
std::string golden(int version) { return unpackedGolden("database_v" + std::to_string(version)); }

TEST_F(GoldenTest, ThereIsOneForEachVersion) {
    EXPECT_FALSE(golden(static_cast<int>(embeddedMigrations().size())).empty());
}

TEST_F(GoldenTest, CanBeWritten) {
    const char* target = std::getenv("SHAPEDB_WRITE_GOLDEN");
    fill(*store_);
    expectSound();
    store_.reset();
    const std::string bytes = slurp(options().path);
    ASSERT_FALSE(bytes.empty());
    if (target == nullptr) return;
    writeGolden(target, bytes);
}

TEST_P(EachGoldenTest, IsMigratedWhenItsCollectionIsImported) {
    const std::string path = folder_.file("old.db");
    spill(path, golden(GetParam()));
    SqliteConnection(path, OpenMode::kReadWrite, 0).execute("DELETE FROM collection WHERE name = 'empty'");
    const std::string before = slurp(path);
    const auto imported = store_->importCollection(path, {}, {});
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_TRUE(slurp(path) == before) << "the file is left as it is";
    EXPECT_EQ(imported->parameters, "theta=20");
    EXPECT_EQ(store_->countShapes(imported->id, {}).value(), 3u);
    EXPECT_EQ(store_->loadIndex(imported->id, 0, 10)->size(), 2u);
    EXPECT_EQ(store_->queueDepth()->jobs, 1u);
    EXPECT_EQ(store_->getSignature(store_->getShape(imported->id, "ready")->id)->bytes, "signature of 1/1/1");
    expectSound();
}

TEST_P(EachGoldenTest, OpensAndAnswers) {
    const std::string bytes = golden(GetParam());
    ASSERT_FALSE(bytes.empty());
    store_.reset();
    spill(options().path, bytes);
    forgetTheOneBefore(options().path);
    open();
    EXPECT_EQ(store_->stats()->schemaVersion, static_cast<int>(embeddedMigrations().size()));
    expectSound();

    const Collection c = store_->getCollection("golden").value();
    EXPECT_EQ(c.parameters, "theta=20");
    EXPECT_EQ(c.generation, 1);
    const auto aliases = store_->listAliases().value();
    ASSERT_EQ(aliases.size(), GetParam() >= 5 ? 1u : 0u);
    if (!aliases.empty()) {
        EXPECT_EQ(aliases.front().name, "gold");
        EXPECT_EQ(aliases.front().collectionId, c.id);
    }
    const auto changed = store_->listShapes(c.id, {ShapeOrder::kUpdated, true, std::nullopt}, 10, {}).value();
    ASSERT_EQ(changed.size(), 3u);
    EXPECT_EQ(changed.front().key, "replaced");
    const Shape ready = store_->getShape(c.id, "ready").value();
    EXPECT_EQ(ready.state, ShapeState::kReady);
    EXPECT_EQ(ready.metadata, (Metadata{{"label", "tetrahedron"}, {"n", "4"}}));
    EXPECT_EQ(store_->loadPoints(ready.id)->xyz, kTetrahedron);
    EXPECT_EQ(store_->getSignature(ready.id)->bytes, "signature of 1/1/1");
    EXPECT_EQ(store_->getSignature(ready.id)->views, GetParam() >= 3 ? "views of 1/1" : "");
    const auto surface = store_->getSurface(ready.id).value();
    ASSERT_EQ(surface.has_value(), GetParam() >= 2) << "older shapes have none until they are rebuilt";
    if (surface) {
        EXPECT_EQ(surface->bytes, "surface of 1/1");
    }
    const Shape replaced = store_->getShape(c.id, "replaced").value();
    EXPECT_EQ(replaced.state, ShapeState::kPending);
    EXPECT_EQ(replaced.version, 2);
    EXPECT_EQ(store_->loadPoints(replaced.id)->xyz, ball());
    EXPECT_EQ(replaced.origin, GetParam() >= 6 ? kSite : Point3{});
    EXPECT_EQ(ready.origin, Point3{});
    EXPECT_EQ(store_->getSignature(replaced.id)->pointsVersion, 1);
    const Shape failed = store_->getShape(c.id, "failed").value();
    EXPECT_EQ(failed.failure->code, ErrorCode::kNoInterior);
    EXPECT_EQ(failed.failure->message, "no closed interior");
    EXPECT_EQ(store_->loadIndex(c.id, 0, 10)->size(), 2u);
    EXPECT_EQ(store_->countWaiting(c.id).value(), 0u) << "the old signature serves";
    const auto gone = store_->deleteShape(c.id, "gone", 1);
    ASSERT_EQ(gone.has_value(), GetParam() >= 7);
    if (gone) {
        EXPECT_EQ(gone->metadata.at("label"), "gone");
    }

    // Work continues: the interrupted job and the rebuild finish.
    ASSERT_TRUE(store_->recoverJobs(2, {})->empty());
    EXPECT_EQ(store_->queueDepth()->jobs, 1u);
    finishAll();
    const Rebuild rebuild = store_->runningRebuilds()->front();
    EXPECT_EQ(rebuild.done, 1u);
    const auto missing = store_->rebuildBatch(rebuild.id, 0, 10).value();
    EXPECT_EQ(missing.size(), 2u);
    for (const Shape& shape : missing) {
        ASSERT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(shape.id, shape.pointsVersion, 2)));
    }
    EXPECT_TRUE(store_->finishRebuild(rebuild.id).value());
    expectSound();
}

using OffsetMigration = GoldenTest;

/// The last database of before shape.origin, with an offset in the metadata of each shape, opened.
void openWithOffset(const std::string& path, const std::string& offset) {
    spill(path, golden(5));
    forgetTheOneBefore(path);
    SqliteConnection connection(path, OpenMode::kReadWrite, 0);
    connection.execute("INSERT INTO shape_metadata SELECT id, 'shapedb.offset', '" + offset + "' FROM shape");
}

TEST_F(OffsetMigration, OffsetsInMetadataBecomeOrigins) {
    store_.reset();
    openWithOffset(options().path, "4500000.1000000001 -0.5 1e-300");
    open();
    expectSound();
    const Collection c = store_->getCollection("golden").value();
    for (const char* key : {"ready", "replaced", "failed"}) {
        const Shape shape = store_->getShape(c.id, key).value();
        EXPECT_NEAR(shape.origin.x, 4500000.1, 1e-9) << key;
        EXPECT_EQ(shape.origin.y, -0.5) << key;
        EXPECT_EQ(shape.metadata.count("shapedb.offset"), 0u) << key;
        EXPECT_EQ(shape.state == ShapeState::kFailed, key == std::string("failed"));
    }
    // Found as before until it is segmented again.
    const Shape ready = store_->getShape(c.id, "ready").value();
    EXPECT_EQ(ready.state, ShapeState::kPending);
    EXPECT_EQ(ready.metadata, (Metadata{{"label", "tetrahedron"}, {"n", "4"}}));
    EXPECT_EQ(store_->getSignature(ready.id)->bytes, "signature of 1/1/1");
    EXPECT_EQ(store_->loadIndex(c.id, 0, 10)->size(), 2u);
    EXPECT_EQ(store_->queueDepth()->jobs, 2u) << "that one, and one that was pending";
    ASSERT_TRUE(store_->recoverJobs(2, {})->empty());
    finishAll();
    EXPECT_EQ(store_->getShape(c.id, "ready")->state, ShapeState::kReady);
    const Rebuild rebuild = store_->runningRebuilds()->front();
    EXPECT_EQ(rebuild.done, 0u) << "what it had made was relative to the offset";
    const auto missing = store_->rebuildBatch(rebuild.id, 0, 10).value();
    EXPECT_EQ(missing.size(), 3u);
    for (const Shape& shape : missing) {
        ASSERT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(shape.id, shape.pointsVersion, 2)));
    }
    EXPECT_TRUE(store_->finishRebuild(rebuild.id).value());
    expectSound();
}

TEST_F(OffsetMigration, OtherTextUnderThatKeyIsLeftAlone) {
    for (const char* text :
         {"", "a cup", "1 2", "1 2 3 4", "1  2 3", "1,2,3,4", "[1] 2 3", "nan 0 0", "true 1 2", "null 1 2",
          "1 2 \"3\"", "1e39 0 0", "1e999 0 0", "{\"a\":1} 2 3", "1] [2 3"}) {
        store_.reset();
        openWithOffset(options().path, text);
        open();
        const Collection c = store_->getCollection("golden").value();
        const Shape shape = store_->getShape(c.id, "ready").value();
        EXPECT_EQ(shape.origin, Point3{}) << text;
        EXPECT_EQ(shape.metadata.at("shapedb.offset"), text);
        EXPECT_EQ(shape.state, ShapeState::kReady) << text;
        EXPECT_EQ(store_->queueDepth()->jobs, 1u) << text;
    }
    // The smallest integer has no absolute value as one.
    store_.reset();
    openWithOffset(options().path, "-9223372036854775808 0 9223372036854775807");
    open();
    EXPECT_EQ(store_->getShape(store_->getCollection("golden")->id, "ready")->origin,
              (Point3{-0x1p63, 0.0, 0x1p63}));
    // It was nobody's offset, and is told as what no upload could have.
    const auto problems = store_->check({}).value();
    ASSERT_FALSE(problems.empty());
    EXPECT_NE(problems.front().find("origin: coordinates up to 9.22337e+18"), std::string::npos)
        << problems.front();
}

TEST_F(OffsetMigration, ExportsOfEarlierVersionsAreImportedWithTheirOrigins) {
    const std::string path = folder_.file("old.db");
    openWithOffset(path, "4500000 0 -3");
    SqliteConnection(path, OpenMode::kReadWrite, 0).execute("DELETE FROM collection WHERE name = 'empty'");
    const auto imported = store_->importCollection(path, {}, {});
    ASSERT_TRUE(imported) << imported.error().message;
    const Shape shape = store_->getShape(imported->id, "ready").value();
    EXPECT_EQ(shape.origin, (Point3{4.5e6, 0.0, -3.0}));
    EXPECT_EQ(shape.state, ShapeState::kPending);
    EXPECT_EQ(store_->queueDepth()->jobs, 2u);
    finishAll();
    expectSound();
}

TEST_F(OffsetMigration, AnOriginThatNoClientCouldSendIsDamage) {
    const Collection c = collection();
    put(c.id, "a", 1);
    finishAll();
    store_.reset();
    {
        SqliteConnection connection(options().path, OpenMode::kReadWrite, 0);
        EXPECT_THROW(connection.execute("UPDATE shape SET origin_x = 3.5e38"), Failure);
        EXPECT_THROW(connection.execute("UPDATE shape SET origin_y = 9e999"), Failure);
        EXPECT_THROW(connection.execute("UPDATE shape SET origin_z = NULL"), Failure);
        connection.execute("PRAGMA ignore_check_constraints = ON; UPDATE shape SET origin_x = 9e999");
        EXPECT_EQ(connection.text("SELECT origin_x FROM shape"), "Inf");
    }
    open();
    const auto problems = store_->check({}).value();
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_EQ(problems.front(), "shape 'a' has points relative to an origin that is out of range");
    const std::string copy = folder_.file("copy.db");
    ASSERT_TRUE(store_->backup(copy, {}));
    EXPECT_FAILS(store_->restore(copy, {}, nullptr), ErrorCode::kMalformedFile);
}

}  // namespace
}  // namespace shapedb::store
