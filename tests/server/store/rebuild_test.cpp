// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class RebuildTest : public EachStoreTest {
  protected:
    /// Stores results for all shapes that the rebuild still lists.
    void rebuildAll(const Rebuild& rebuild, const std::string& failingKey = "") {
        const auto batch = store_->rebuildBatch(rebuild.id, 0, 1000);
        ASSERT_TRUE(batch) << batch.error().message;
        for (const Shape& shape : *batch) {
            if (shape.key == failingKey) {
                ASSERT_TRUE(store_->putRebuildFailure(rebuild.id, shape.id, shape.pointsVersion,
                                                      {ErrorCode::kNoInterior, "hollow"}));
            } else {
                ASSERT_TRUE(store_->putRebuilt(
                    rebuild.id, signatureFor(shape.id, shape.pointsVersion, rebuild.targetGeneration)));
            }
        }
    }
};

TEST_P(RebuildTest, OldGenerationServesUntilTheSwitch) {
    const Collection c = collection();
    const Shape a = put(c.id, "a", 1);
    const Shape b = put(c.id, "b", 2);
    const Shape f = put(c.id, "f", 3);
    for (int i = 0; i < 2; ++i) {
        const Job job = claim();
        ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
    }
    ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kCoplanar, "flat"}));

    const Rebuild started = store_->startRebuild(c.id, "finer").value();
    EXPECT_EQ(started.targetGeneration, 2);
    EXPECT_EQ(started.total, 3u);
    EXPECT_EQ(started.done, 0u);
    EXPECT_FAILS(store_->startRebuild(c.id, "x"), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->startRebuild(99, "x"), ErrorCode::kNotFound);
    EXPECT_FALSE(store_->finishRebuild(started.id).value());

    // Resumable: after a restart only the missing ones are listed.
    ASSERT_TRUE(store_->putRebuilt(started.id, signatureFor(a.id, 1, 2)));
    open();
    ASSERT_EQ(store_->runningRebuilds()->size(), 1u);
    EXPECT_EQ(store_->runningRebuilds()->front().done, 1u);
    const auto batch = store_->rebuildBatch(started.id, 0, 10).value();
    ASSERT_EQ(batch.size(), 2u);
    EXPECT_EQ(batch[0].id, b.id);
    EXPECT_EQ(store_->rebuildBatch(started.id, b.id, 10)->front().id, f.id);
    EXPECT_EQ(store_->rebuildBatch(started.id, 0, 1)->size(), 1u);

    EXPECT_EQ(store_->getSignature(a.id)->generation, 1);
    EXPECT_EQ(store_->loadIndex(c.id, 0, 10)->size(), 2u);
    rebuildAll(started, "b");
    EXPECT_EQ(store_->getRebuild(started.id)->done, 3u);
    EXPECT_EQ(store_->getRebuild(started.id)->failed, 1u);
    EXPECT_EQ(store_->getShapeById(b.id)->state, ShapeState::kReady);
    EXPECT_TRUE(store_->finishRebuild(started.id).value());

    EXPECT_EQ(store_->getCollection("parts")->generation, 2);
    EXPECT_EQ(store_->getCollection("parts")->parameters, "finer");
    EXPECT_EQ(store_->getSignature(a.id)->generation, 2);
    EXPECT_EQ(store_->getShapeById(b.id)->state, ShapeState::kFailed);
    EXPECT_EQ(store_->getShapeById(b.id)->failure->code, ErrorCode::kNoInterior);
    EXPECT_FAILS(store_->getSignature(b.id), ErrorCode::kNotReady);
    EXPECT_EQ(store_->getShapeById(f.id)->state, ShapeState::kReady);
    EXPECT_FALSE(store_->getShapeById(f.id)->failure);
    EXPECT_EQ(store_->stats()->signatures, 2u);
    const Rebuild done = store_->getRebuild(started.id).value();
    EXPECT_EQ(done.state, RebuildState::kDone);
    EXPECT_EQ(done.done, 3u);
    EXPECT_EQ(done.failed, 1u);
    EXPECT_EQ(done.total, 3u);
    EXPECT_GT(done.finishedAt, done.startedAt);
    EXPECT_TRUE(store_->runningRebuilds()->empty());
    EXPECT_FAILS(store_->finishRebuild(started.id), ErrorCode::kRejected);
    EXPECT_FAILS(store_->putRebuilt(started.id, signatureFor(a.id, 1, 2)), ErrorCode::kRejected);
    expectSound();
}

TEST_P(RebuildTest, QueuedShapesDoNotBlockTheSwitch) {
    const Collection c = collection();
    const Shape a = put(c.id, "a", 1);
    finishAll();
    put(c.id, "a", 2);
    const Shape fresh = put(c.id, "fresh", 3);
    const Rebuild rebuild = store_->startRebuild(c.id, "finer").value();
    EXPECT_TRUE(store_->rebuildBatch(rebuild.id, 0, 10)->empty());
    const Job running = claim();  // with the parameters of generation 1
    EXPECT_TRUE(store_->finishRebuild(rebuild.id).value());
    EXPECT_FAILS(store_->getSignature(a.id), ErrorCode::kNotReady);
    EXPECT_EQ(store_->getShapeById(a.id)->state, ShapeState::kPending);

    // The outdated result is dropped and the job queued again as if untried.
    EXPECT_FALSE(store_->finishJob(running, signatureFor(running)).value());
    EXPECT_EQ(store_->queueDepth()->jobs, 2u);
    const Job again = claim();
    EXPECT_EQ(again.id, running.id);
    EXPECT_EQ(again.attempts, 1);
    EXPECT_EQ(again.generation, 2);
    EXPECT_TRUE(store_->finishJob(again, signatureFor(again)).value());
    EXPECT_EQ(store_->getSignature(a.id)->generation, 2);
    finishAll();
    EXPECT_EQ(store_->getSignature(fresh.id)->generation, 2);
    expectSound();
}

TEST_P(RebuildTest, OutdatedFailuresAreTriedAgain) {
    const Collection c = collection();
    put(c.id, "a", 1);
    const Job running = claim();
    const Rebuild rebuild = store_->startRebuild(c.id, "finer").value();
    ASSERT_TRUE(store_->finishRebuild(rebuild.id).value());
    EXPECT_FALSE(store_->failJob(running, {ErrorCode::kNoInterior, "coarse"}).value());
    EXPECT_EQ(store_->getShape(c.id, "a")->state, ShapeState::kPending);
    EXPECT_EQ(claim().generation, 2);
}

TEST_P(RebuildTest, JobFinishedMeanwhileStillNeedsAResult) {
    const Collection c = collection();
    const Shape a = put(c.id, "a", 1);
    const Rebuild rebuild = store_->startRebuild(c.id, "finer").value();
    finishAll();
    EXPECT_FALSE(store_->finishRebuild(rebuild.id).value());
    ASSERT_EQ(store_->rebuildBatch(rebuild.id, 0, 10)->size(), 1u);
    EXPECT_EQ(store_->getSignature(a.id)->generation, 1);
    rebuildAll(rebuild);
    EXPECT_EQ(store_->getSignature(a.id)->generation, 1);

    // New points drop the rebuilt result; so does the failure of their job.
    put(c.id, "a", 2);
    EXPECT_EQ(store_->getRebuild(rebuild.id)->done, 0u);
    ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kNoInterior, ""}));
    EXPECT_FALSE(store_->finishRebuild(rebuild.id).value());
    rebuildAll(rebuild);
    EXPECT_TRUE(store_->finishRebuild(rebuild.id).value());
    EXPECT_EQ(store_->getShapeById(a.id)->state, ShapeState::kReady);
    EXPECT_EQ(store_->getSignature(a.id)->pointsVersion, 2);
    expectSound();
}

TEST_P(RebuildTest, StaleResultsAreDroppedSilently) {
    const Collection c = collection();
    const Collection other = collection("other");
    const Shape a = put(c.id, "a", 1);
    const Shape alien = put(other.id, "a", 1);
    finishAll();
    const Rebuild rebuild = store_->startRebuild(c.id, "finer").value();
    put(c.id, "a", 2);
    finishAll();
    EXPECT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(a.id, 1, 2)));
    EXPECT_TRUE(store_->putRebuildFailure(rebuild.id, a.id, 1, {ErrorCode::kCoplanar, ""}));
    EXPECT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(alien.id, 1, 2)));
    EXPECT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(999, 1, 2)));
    EXPECT_EQ(store_->getRebuild(rebuild.id)->done, 0u);
    EXPECT_FAILS(store_->putRebuilt(rebuild.id, signatureFor(a.id, 2, 3)), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(store_->putRebuilt(77, signatureFor(a.id, 2, 2)), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->putRebuildFailure(77, a.id, 2, {}), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->rebuildBatch(77, 0, 1), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->getRebuild(77), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->finishRebuild(77), ErrorCode::kNotFound);

    // The last result counts.
    EXPECT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(a.id, 2, 2)));
    EXPECT_TRUE(store_->putRebuildFailure(rebuild.id, a.id, 2, {ErrorCode::kCoplanar, ""}));
    EXPECT_EQ(store_->getRebuild(rebuild.id)->done, 1u);
    EXPECT_EQ(store_->getRebuild(rebuild.id)->failed, 1u);
    EXPECT_TRUE(store_->putRebuilt(rebuild.id, signatureFor(a.id, 2, 2)));
    EXPECT_EQ(store_->getRebuild(rebuild.id)->failed, 0u);
    expectSound();
}

TEST_P(RebuildTest, AbandonLeavesTheOldGeneration) {
    const Collection c = collection();
    const Shape a = put(c.id, "a", 1);
    finishAll();
    const Rebuild rebuild = store_->startRebuild(c.id, "finer").value();
    rebuildAll(rebuild);
    EXPECT_FAILS(store_->abandonRebuild(rebuild.id, RebuildState::kDone), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(store_->abandonRebuild(77, RebuildState::kFailed), ErrorCode::kNotFound);
    ASSERT_TRUE(store_->abandonRebuild(rebuild.id, RebuildState::kCancelled));
    EXPECT_FAILS(store_->abandonRebuild(rebuild.id, RebuildState::kFailed), ErrorCode::kRejected);
    const Rebuild ended = store_->getRebuild(rebuild.id).value();
    EXPECT_EQ(ended.state, RebuildState::kCancelled);
    EXPECT_EQ(ended.done, 1u);
    EXPECT_EQ(store_->stats()->signatures, 1u);
    EXPECT_EQ(store_->getSignature(a.id)->generation, 1);
    EXPECT_EQ(store_->getCollection("parts")->parameters, "parameters of parts");
    const Rebuild second = store_->startRebuild(c.id, "other").value();
    EXPECT_EQ(second.targetGeneration, 2);
    EXPECT_EQ(second.done, 0u);
    expectSound();
}

TEST_P(RebuildTest, EmptyCollectionFinishesAtOnce) {
    const Collection c = collection();
    const Rebuild rebuild = store_->startRebuild(c.id, "finer").value();
    EXPECT_TRUE(store_->finishRebuild(rebuild.id).value());
    EXPECT_EQ(store_->getCollection("parts")->generation, 2);
}

SHAPEDB_ON_EACH_ENGINE(RebuildTest);

}  // namespace
}  // namespace shapedb::store
