// SPDX-License-Identifier: GPL-3.0-or-later
// How many pending shapes no search finds yet: kept by the database, always what a count would say.
#include <optional>
#include <set>

#include "core/base/random.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class WaitingTest : public EachStoreTest {
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
        const auto batch = store_->rebuildBatch(rebuild->id, 0, 2).value();
        for (const Shape& shape : batch) {
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

TEST_P(WaitingTest, OnlyShapesThatNoSearchFindsAreCounted) {
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

TEST_P(WaitingTest, IsWhatACountSaysAfterAnyChange) {
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

TEST_P(WaitingTest, AWrongCountIsAProblem) {
    const Collection parts = collection();
    put(parts.id, "a", 1);
    store_.reset();
    execute("UPDATE collection SET waiting = 7");
    open();
    const auto problems = store_->check({}).value();
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_EQ(problems[0], "table collection, row 1 has a wrong count of waiting shapes");
}

SHAPEDB_ON_EACH_ENGINE(WaitingTest);

}  // namespace
}  // namespace shapedb::store
