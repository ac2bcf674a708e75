// SPDX-License-Identifier: GPL-3.0-or-later
// How many pending shapes no search finds yet: kept by the database, always what a count would say.
#include <chrono>
#include <optional>
#include <set>

#include "core/base/random.h"
#include "server/store/sqlite/connection.h"
#include "tests/server/store/sqlite/store_fixture.h"

namespace shapedb::store {
namespace {

class WaitingTest : public StoreTest {
  protected:
    std::uint64_t waiting(std::int64_t collectionId) { return store_->countWaiting(collectionId).value(); }

    /// Pending shapes of which the index holds no signature.
    std::uint64_t counted(std::int64_t collectionId) {
        std::set<std::int64_t> searched;
        const auto rows = store_->loadIndex(collectionId, 0, 1'000).value();
        for (const IndexRow& row : rows) searched.insert(row.shapeId);
        ShapeFilter filter;
        filter.state = ShapeState::kPending;
        filter.accept = [&](const Shape& shape) { return searched.count(shape.id) == 0; };
        return store_->countShapes(collectionId, filter).value();
    }

    /// Any of the changes that there are.
    void change(std::int64_t id, Random& random, std::optional<Rebuild>& rebuild) {
        const std::string key = std::to_string(random.below(8));
        const auto choice = random.below(8);
        if (choice < 2) put(id, key, random.below(20));
        if (choice == 2) static_cast<void>(store_->deleteShape(id, key, std::nullopt));
        if (choice == 3 || choice == 4) {
            const auto job = store_->claimJob().value();
            if (job && choice == 3) {
                EXPECT_TRUE(store_->finishJob(*job, signatureFor(*job)));
            }
            if (job && choice == 4) {
                EXPECT_TRUE(store_->failJob(*job, kNoInside));
            }
        }
        if (choice == 5) {
            const auto shape = store_->getShape(id, key);
            if (shape) {
                EXPECT_TRUE(store_->retryShapes({shape->id}, 0, 0));
            }
        }
        if (choice == 6) rebuildSome(id, random, rebuild);
        if (choice == 7 && rebuild && store_->finishRebuild(rebuild->id).value()) rebuild.reset();
    }

    void rebuildSome(std::int64_t id, Random& random, std::optional<Rebuild>& rebuild) {
        if (!rebuild) rebuild = store_->startRebuild(id, "others").value();
        for (const Shape& shape : store_->rebuildBatch(rebuild->id, 0, 2).value()) {
            const auto signature = signatureFor(shape.id, shape.pointsVersion, rebuild->targetGeneration);
            const bool failed = random.below(3) == 0;
            const auto done =
                failed ? store_->putRebuildFailure(rebuild->id, shape.id, shape.pointsVersion, kNoInside)
                       : store_->putRebuilt(rebuild->id, signature);
            EXPECT_TRUE(done);
        }
    }

    const Error kNoInside{ErrorCode::kNoInterior, "no"};
};

TEST_F(WaitingTest, OnlyShapesThatNoSearchFindsAreCounted) {
    const Collection parts = collection();
    const Collection other = collection("other");
    put(other.id, "c", 4);
    put(parts.id, "done", 1);
    EXPECT_EQ(waiting(parts.id), 1u);
    finishAll();
    EXPECT_EQ(waiting(parts.id), 0u);
    put(parts.id, "done", 2);  // the old signature serves
    put(parts.id, "a", 3);
    EXPECT_EQ(waiting(parts.id), 1u);
    EXPECT_EQ(waiting(other.id), 0u);
    ASSERT_TRUE(store_->deleteShape(parts.id, "a", std::nullopt));
    EXPECT_EQ(waiting(parts.id), 0u);
    put(parts.id, "b", 3);
    while (const auto job = store_->claimJob().value()) {
        ASSERT_TRUE(store_->failJob(*job, kNoInside));
    }
    EXPECT_EQ(waiting(parts.id), 0u);
    EXPECT_EQ(store_->retryShapes({store_->getShape(parts.id, "b")->id}, 0, 0).value(), 1u);
    EXPECT_EQ(waiting(parts.id), 1u);
    expectSound();
}

TEST_F(WaitingTest, IsWhatACountSaysAfterAnyChange) {
    const Collection parts = collection();
    Random random(7);
    std::optional<Rebuild> rebuild;
    for (int step = 0; step < 400; ++step) {
        change(parts.id, random, rebuild);
        ASSERT_EQ(waiting(parts.id), counted(parts.id)) << "step " << step;
    }
    expectSound();
    const std::string file = folder_.file("export.db");
    ASSERT_TRUE(store_->exportCollection(parts.id, file, {}));
    ImportRequest as;
    as.name = "copy";
    const auto copy = store_->importCollection(file, as, {});
    ASSERT_TRUE(copy) << copy.error().message;
    EXPECT_EQ(waiting(copy->id), counted(copy->id));
    expectSound();
}

TEST_F(WaitingTest, CostsNothingHoweverManyThereAre) {
    const Collection parts = collection();
    put(parts.id, "first", 1);
    store_.reset();
    {
        Connection connection(options().path, OpenMode::kReadWrite, 1'000);
        connection.execute(
            "BEGIN; WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 100000) INSERT "
            "INTO "
            "shape (collection_id, key, version, points_version, state, point_count, checksum, created_at, "
            "updated_at) SELECT s.collection_id, 'n' || i, 1, 1, 0, 8, s.checksum, 1, 1 FROM n, shape s "
            "WHERE s.id "
            "= 1; COMMIT");
    }
    open();
    const auto began = std::chrono::steady_clock::now();
    for (int i = 0; i < 100; ++i) ASSERT_EQ(waiting(parts.id), 100'001u);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - began;
    EXPECT_LT(taken.count(), 0.5) << "a hundred times";
}

TEST_F(WaitingTest, AWrongCountIsAProblem) {
    const Collection parts = collection();
    put(parts.id, "a", 1);
    store_.reset();
    Connection(options().path, OpenMode::kReadWrite, 1'000).execute("UPDATE collection SET waiting = 7");
    open();
    const auto problems = store_->check({}).value();
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_EQ(problems[0], "table collection, row 1 counts other shapes as waiting than those that are");
}

}  // namespace
}  // namespace shapedb::store
