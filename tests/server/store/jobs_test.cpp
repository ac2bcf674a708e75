// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/quarantine.h"
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

using JobsTest = EachStoreTest;

TEST_P(JobsTest, ClaimsTheOldestFirstAndReleaseKeepsThePlace) {
    const Collection c = collection();
    EXPECT_FALSE(store_->claimJob().value());
    const Shape a = put(c.id, "a", 1);
    const Shape b = put(c.id, "b", 2);
    const Job first = claim();
    EXPECT_EQ(first.shapeId, a.id);
    EXPECT_EQ(first.collectionId, c.id);
    EXPECT_EQ(first.pointsVersion, 1);
    EXPECT_EQ(first.generation, 1);
    EXPECT_EQ(first.attempts, 1);
    EXPECT_EQ(first.pointBytes, 96u);
    const Job second = claim();
    EXPECT_EQ(second.shapeId, b.id);
    EXPECT_FALSE(store_->claimJob().value());
    ASSERT_TRUE(store_->releaseJob(second));
    ASSERT_TRUE(store_->releaseJob(first));
    ASSERT_TRUE(store_->releaseJob(first)) << "a second release is nothing";
    const Job again = claim();
    EXPECT_EQ(again.id, first.id);
    EXPECT_EQ(again.attempts, 1);
    EXPECT_EQ(store_->queueDepth()->jobs, 2u);
}

TEST_P(JobsTest, FinishMakesTheShapeReady) {
    const Collection c = collection();
    const Shape shape = put(c.id, "a", 1, {{"label", "cup"}});
    const Job job = claim();
    const auto done = store_->finishJob(job, signatureFor(job)).value();
    ASSERT_TRUE(done);
    EXPECT_EQ(done->state, ShapeState::kReady);
    EXPECT_EQ(done->version, 1);
    EXPECT_EQ(done->metadata, shape.metadata);
    EXPECT_EQ(store_->getSignature(shape.id)->bytes, signatureFor(job).bytes);
    EXPECT_EQ(store_->getSignature(shape.id)->views, signatureFor(job).views);
    EXPECT_EQ(store_->getSurface(shape.id).value()->bytes, signatureFor(job).surface);
    EXPECT_EQ(store_->getSurface(shape.id).value()->pointsVersion, 1);
    EXPECT_EQ(store_->queueDepth()->jobs, 0u);
    EXPECT_EQ(store_->queueDepth()->bytes, 0u);
    EXPECT_FALSE(store_->finishJob(job, signatureFor(job)).value()) << "the job is gone";
    EXPECT_FALSE(store_->failJob(job, {ErrorCode::kInternal, "late"}).value());
    expectSound();
}

TEST_P(JobsTest, ASurfaceServesUntilTheNextResult) {
    const Collection c = collection();
    const Shape shape = put(c.id, "a", 1);
    EXPECT_FALSE(store_->getSurface(shape.id).value()) << "pending";
    Job job = claim();
    ASSERT_TRUE(store_->finishJob(job, signatureFor(job)).value());
    put(c.id, "a", 2);
    EXPECT_EQ(store_->getSurface(shape.id).value()->pointsVersion, 1) << "like the signature";
    job = claim();
    SignatureRow row = signatureFor(job);
    row.surface = std::string("\0\x01", 2);
    ASSERT_TRUE(store_->finishJob(job, row).value());
    EXPECT_EQ(store_->getSurface(shape.id).value()->bytes, row.surface);
    EXPECT_EQ(store_->getSurface(shape.id).value()->pointsVersion, 2);
    put(c.id, "a", 3);
    ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kNoInterior, "open"}).value());
    EXPECT_FALSE(store_->getSurface(shape.id).value());
    expectSound();
    EXPECT_FAILS(store_->getSurface(shape.id + 1), ErrorCode::kNotFound);
}

TEST_P(JobsTest, DamagedSurfacesAreToldByReadsAndChecks) {
    const Collection c = collection();
    const Shape shape = put(c.id, "a", 1);
    const Job job = claim();
    ASSERT_TRUE(store_->finishJob(job, signatureFor(job)).value());
    store_.reset();
    execute("UPDATE shape_surface SET digest = digest + 1");
    open();
    EXPECT_FAILS(store_->getSurface(shape.id), ErrorCode::kDataLoss);
    const auto problems = store_->check({}).value();
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_NE(problems.front().find("surface points of shape 'a'"), std::string::npos) << problems.front();
}

TEST_P(JobsTest, StoresSignaturesAsBytes) {
    const Collection c = collection();
    for (const std::string& bytes : {std::string(), std::string("a\0\xff", 3), std::string(100000, 'x')}) {
        put(c.id, "a", bytes.size() + 50);
        const Job job = claim();
        SignatureRow row = signatureFor(job);
        row.bytes = bytes;
        ASSERT_TRUE(store_->finishJob(job, row));
        EXPECT_EQ(store_->getSignature(job.shapeId)->bytes, bytes);
    }
}

TEST_P(JobsTest, DropsResultsOfDeletedOrReplacedPoints) {
    const Collection c = collection();
    put(c.id, "a", 1);
    const Job old = claim();
    put(c.id, "a", 2);
    EXPECT_FALSE(store_->finishJob(old, signatureFor(old)).value());
    EXPECT_FALSE(store_->failJob(old, {ErrorCode::kCoplanar, ""}).value());
    ASSERT_TRUE(store_->releaseJob(old));
    EXPECT_EQ(store_->getShape(c.id, "a")->state, ShapeState::kPending);
    const Job job = claim();
    EXPECT_EQ(job.pointsVersion, 2);
    ASSERT_TRUE(store_->deleteShape(c.id, "a", {}));
    EXPECT_FALSE(store_->finishJob(job, signatureFor(job)).value());
    EXPECT_EQ(store_->queueDepth()->jobs, 0u);
    EXPECT_EQ(store_->stats()->signatures, 0u);
}

TEST_P(JobsTest, WrongSignaturesAreRefused) {
    const Collection c = collection();
    const Shape other = put(c.id, "b", 2);
    finishAll();
    put(c.id, "a", 1);
    const Job job = claim();
    EXPECT_FAILS(store_->finishJob(job, signatureFor(other.id, 1, 1)), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(store_->finishJob(job, signatureFor(job.shapeId, 2, 1)), ErrorCode::kInvalidArgument);
    EXPECT_FAILS(store_->finishJob(job, signatureFor(job.shapeId, 1, 2)), ErrorCode::kInvalidArgument);
    EXPECT_TRUE(store_->finishJob(job, signatureFor(job)).value());
}

TEST_P(JobsTest, QuarantinesJobsThatCrashTheServer) {
    const Collection c = collection();
    const Shape bad = put(c.id, "bad", 1);
    finishAll();
    put(c.id, "bad", 2);  // its old signature serves until the quarantine
    const Shape good = put(c.id, "good", 3);
    for (int life = 1; life <= 2; ++life) {
        const Job job = claim();
        EXPECT_EQ(job.shapeId, bad.id);
        EXPECT_EQ(job.attempts, life);
        open();  // the process dies with the job
        const auto quarantined = store_->recoverJobs(2, {{bad.id, 2}}).value();
        ASSERT_EQ(quarantined.size(), life == 2 ? 1u : 0u);
        if (life == 2) {
            EXPECT_EQ(quarantined[0].id, bad.id);
            EXPECT_EQ(quarantined[0].state, ShapeState::kFailed);
            EXPECT_NE(quarantined[0].failure->message.find("2 times"), std::string::npos);
        }
    }
    EXPECT_FAILS(store_->getSignature(bad.id), ErrorCode::kNotReady);
    const Job job = claim();
    EXPECT_EQ(job.shapeId, good.id);
    EXPECT_TRUE(store_->finishJob(job, signatureFor(job)).value());
    EXPECT_FALSE(store_->claimJob().value());
    expectSound();
}

TEST_P(JobsTest, KilledProcessesFailNoScanUntilTheyAreMany) {
    const Collection c = collection();
    const Shape first = put(c.id, "first", 1);
    const Shape second = put(c.id, "second", 2);
    for (int kill = 0; kill < kMostStops; ++kill) {
        Job job = claim();
        if (kill > 0 && job.shapeId == second.id) {
            EXPECT_EQ(kill, 1) << "it waits behind jobs that were stopped less often";
            EXPECT_TRUE(store_->finishJob(job, signatureFor(job)).value());
            job = claim();
        }
        EXPECT_EQ(job.shapeId, first.id);
        EXPECT_EQ(job.attempts, 1);
        EXPECT_EQ(job.stops, kill);
        open();
        EXPECT_EQ(store_->recoverJobs(1, {}).value().size(), kill + 1 == kMostStops ? 1u : 0u) << kill;
    }
    EXPECT_EQ(store_->getShapeById(first.id)->state, ShapeState::kFailed);
    expectSound();
}

TEST_P(JobsTest, FailedShapesAreTriedAgainAsFarAsThereIsRoom) {
    const Collection c = collection();
    std::vector<std::int64_t> ids;
    for (int i = 0; i < 4; ++i) ids.push_back(put(c.id, std::to_string(i), i).id);
    for (int i = 0; i < 3; ++i) {
        const Job job = claim();
        ASSERT_TRUE(store_->failJob(job, {ErrorCode::kNoInterior, "hollow"}).value());
    }
    finishAll();
    EXPECT_EQ(store_->retryShapes({ids[3], 999}, 0, 0).value(), 0u) << "ready, or not there";
    EXPECT_EQ(store_->retryShapes(ids, 2, 0).value(), 2u);
    EXPECT_FAILS(store_->retryShapes(ids, 2, 0), ErrorCode::kQueueFull);
    EXPECT_EQ(store_->getShapeById(ids[0])->state, ShapeState::kPending);
    EXPECT_FALSE(store_->getShapeById(ids[0])->failure);
    finishAll();
    EXPECT_EQ(store_->retryShapes(ids, 2, 0).value(), 1u);
    finishAll();
    EXPECT_EQ(store_->getShapeById(ids[2])->state, ShapeState::kReady);
    expectSound();
}

SHAPEDB_ON_EACH_ENGINE(JobsTest);

}  // namespace
}  // namespace shapedb::store
