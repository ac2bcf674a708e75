// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/worker_pool.h"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::ingest {
namespace {

using namespace shapedb::testing;
using namespace std::chrono_literals;

/// A pipeline that waits inside a scan until released or cancelled.
class Gate {
  public:
    Result<Description> describe(const PointCloud& points, const ShapeParameters& parameters,
                                 const RunContext& context) {
        ++entered_;
        while (closed_) {
            if (const auto go = context.checkpoint(); !go) return fail(go.error());
            std::this_thread::sleep_for(1ms);
        }
        return quickDescribe(points, parameters, context);
    }
    void open() { closed_ = false; }
    int entered() const { return entered_; }

  private:
    std::atomic<bool> closed_{true};
    std::atomic<int> entered_{0};
};

class Pool : public ::testing::Test {
  protected:
    Pool() : log(std::make_shared<RecordingLogger>()), index(store, log) {
        parts = *store.createCollection("parts", "", paperParameters());
        EXPECT_TRUE(index.loadAll());
    }

    WorkerPool& start(SignaturePipeline describe = quickDescribe, int threads = 2) {
        WorkerOptions options;
        options.threads = threads;
        options.backOff = backOff;
        options.crashes = crashes;
        describe.pauseWithoutMemory({});
        pool =
            std::make_unique<WorkerPool>(store, index, board, isolation, std::move(describe), log, options);
        EXPECT_TRUE(pool->start());
        return *pool;
    }

    SignaturePipeline through(Gate& gate) {
        return [&gate](const PointCloud& points, const ShapeParameters& parameters,
                       const RunContext& context) { return gate.describe(points, parameters, context); };
    }

    store::Shape put(const std::string& key, float tag) {
        const auto points = taggedPoints(tag);
        const auto result = store.putShape(putRequest(parts.id, key, points));
        EXPECT_TRUE(result);
        if (pool) pool->wake();
        return result->shape;
    }

    store::Shape shape(const std::string& key) { return *store.getShape(parts.id, key); }
    bool settled(const std::string& key) { return shape(key).state != store::ShapeState::kPending; }
    bool idle() { return store.queueDepth()->jobs == 0 && pool->running() == 0; }

    MemoryStore store;
    std::shared_ptr<RecordingLogger> log;
    index::CollectionIndex index;
    ProgressBoard board;
    CrashIsolation isolation;
    store::Collection parts;
    std::chrono::milliseconds backOff{5};
    std::vector<store::Crash> crashes;
    std::unique_ptr<WorkerPool> pool;
};

TEST_F(Pool, TurnsScansIntoSearchedSignatures) {
    put("before the start", 1.0f);
    start();
    for (int i = 0; i < 100; ++i) put(std::to_string(i), static_cast<float>(i + 2));
    ASSERT_TRUE(eventually([&] { return idle(); }));
    EXPECT_EQ(pool->ingested(), 101u);
    const auto snapshot = *index.byName("parts");
    EXPECT_EQ(snapshot->signatures.size(), 101u);
    EXPECT_EQ(cachedVolume(snapshot->signatures, shape("7").id), 9.0);
    EXPECT_EQ(shape("7").state, store::ShapeState::kReady);
}

TEST_F(Pool, RecordsWhyAScanFails) {
    start();
    const auto before = put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    put("k", -1.0f);
    ASSERT_TRUE(eventually([&] { return shape("k").state == store::ShapeState::kFailed; }));
    EXPECT_EQ(shape("k").failure->code, ErrorCode::kNoInterior);
    ASSERT_TRUE(eventually([&] { return idle(); }));
    EXPECT_FALSE((*index.byName("parts"))->signatures.find(before.id))
        << "the old signature is of other points";
}

TEST_F(Pool, ExceptionsBecomeFailures) {
    start([](const PointCloud& points, const ShapeParameters&, const RunContext&) -> Result<Description> {
        if (points[0].x > 1.5) throw std::bad_alloc();
        throw std::runtime_error("surprise");
    });
    put("thrown", 1.0f);
    put("memory", 2.0f);
    ASSERT_TRUE(eventually([&] { return settled("thrown") && settled("memory"); }));
    EXPECT_EQ(shape("thrown").failure->code, ErrorCode::kInternal);
    EXPECT_NE(shape("thrown").failure->message.find("surprise"), std::string::npos);
    EXPECT_EQ(shape("memory").failure->code, ErrorCode::kOutOfMemory);
}

TEST_F(Pool, DeletedShapeStopsItsWorker) {
    Gate gate;
    start(through(gate));
    const auto k = put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return gate.entered() == 1; }));
    ASSERT_TRUE(store.deleteShape(parts.id, "k", std::nullopt));
    pool->supersede(k.id);
    EXPECT_TRUE(eventually([&] { return idle(); }));
    EXPECT_EQ(pool->ingested(), 0u);
}

TEST_F(Pool, ReplacedPointsStopOnlyTheOldJob) {
    Gate gate;
    start(through(gate));
    put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return gate.entered() == 1; }));
    const auto replaced = put("k", 2.0f);
    pool->supersede(replaced.id, replaced.pointsVersion);
    // Even when it comes late and the new job is already running.
    ASSERT_TRUE(eventually([&] { return gate.entered() == 2; }));
    pool->supersede(replaced.id, replaced.pointsVersion);
    gate.open();
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    EXPECT_EQ(shape("k").state, store::ShapeState::kReady);
    ASSERT_TRUE(eventually([&] { return idle(); }));
    EXPECT_EQ(cachedVolume((*index.byName("parts"))->signatures, replaced.id), 2.0);
    EXPECT_EQ(pool->ingested(), 1u);
}

TEST_F(Pool, DeletedCollectionStopsItsWorkers) {
    Gate gate;
    start(through(gate));
    put("a", 1.0f);
    put("b", 2.0f);
    ASSERT_TRUE(eventually([&] { return gate.entered() == 2; }));
    ASSERT_TRUE(store.deleteCollection(parts.id));
    index.remove(parts.id);
    pool->supersedeCollection(parts.id);
    EXPECT_TRUE(eventually([&] { return idle(); }));
}

TEST_F(Pool, DrainingPutsStartedJobsBackIntoTheQueue) {
    Gate gate;
    start(through(gate), 1);
    put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return gate.entered() == 1; }));
    pool->stop();
    EXPECT_EQ(shape("k").state, store::ShapeState::kPending);
    EXPECT_EQ(store.queueDepth()->jobs, 1u);
    const auto job = *store.claimJob();
    ASSERT_TRUE(job);
    EXPECT_EQ(job->attempts, 1) << "the attempt that was interrupted does not count";
}

TEST_F(Pool, PauseStopsAndResumeGoesOn) {
    Gate gate;
    start(through(gate));
    for (int i = 0; i < 5; ++i) put(std::to_string(i), static_cast<float>(i + 1));
    ASSERT_TRUE(eventually([&] { return gate.entered() == 2; }));
    pool->pause();
    EXPECT_EQ(pool->running(), 0u);
    gate.open();
    EXPECT_EQ(store.queueDepth()->jobs, 5u) << "put back";
    // A second pool takes all the jobs: the paused one had the work and the time, and took none.
    WorkerPool other(store, index, board, isolation, quickDescribe, log, {});
    ASSERT_TRUE(other.start());
    pool->wake();
    ASSERT_TRUE(eventually([&] { return other.ingested() == 5; }));
    other.stop();
    EXPECT_EQ(pool->ingested(), 0u);
    for (int i = 5; i < 10; ++i) put(std::to_string(i), static_cast<float>(i + 1));
    ASSERT_TRUE(pool->resume(Content::kSame));
    ASSERT_TRUE(eventually([&] { return idle(); }));
    EXPECT_EQ(pool->ingested(), 5u);
}

/// Claims "k", which can be put back again only once the store is not full any more.
class PoolThatCannotPutBack : public Pool {
  protected:
    PoolThatCannotPutBack() {
        put("k", 1.0f);
        EXPECT_TRUE(*store.claimJob());  // one crash, as every innocent scan may have
        crashes = {{shape("k").id, 1}};
        store.fault = [this](const std::string& function) -> std::optional<Error> {
            if (isFull && function == "releaseJob") return Error{ErrorCode::kStorage, "full"};
            return std::nullopt;
        };
        start(through(gate), 1);
        EXPECT_TRUE(eventually([&] { return gate.entered() == 1; }));
        isFull = true;
    }
    ~PoolThatCannotPutBack() override { pool.reset(); }

    Gate gate;
    std::atomic<bool> isFull{false};
};

// A restore that failed is no death of the process.
TEST_F(PoolThatCannotPutBack, AfterAPauseTheJobIsNeitherLostNorSetAside) {
    pool->pause();
    isFull = false;
    gate.open();
    ASSERT_TRUE(pool->resume(Content::kSame));
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    EXPECT_EQ(shape("k").state, store::ShapeState::kReady) << log->all();
}

TEST_F(PoolThatCannotPutBack, StoppingTriesOnceMoreToPutJobsBack) {
    pool->pause();
    isFull = false;
    pool->stop();
    crashes = {{shape("k").id, shape("k").pointsVersion}};
    EXPECT_TRUE(store.recoverJobs(2, crashes)->empty()) << "the next start sets nothing aside";
    EXPECT_EQ((*store.claimJob())->attempts, 2);
}

TEST_F(Pool, JobOfADeadProcessIsDoneAgainButNotForEver) {
    const auto quarantined = put("twice", 1.0f);
    ASSERT_TRUE(*store.claimJob());
    crashes = {{quarantined.id, 1}};
    ASSERT_TRUE(store.recoverJobs(2, crashes));
    ASSERT_TRUE(*store.claimJob());  // second crash
    const auto once = put("once", 2.0f);
    ASSERT_TRUE(*store.claimJob());  // first crash
    crashes.push_back({once.id, 1});
    start();
    EXPECT_EQ(shape("twice").state, store::ShapeState::kFailed);
    EXPECT_NE(log->all().find("key=twice"), std::string::npos) << log->all();
    ASSERT_TRUE(eventually([&] { return settled("once"); }));
    EXPECT_EQ(shape("once").state, store::ShapeState::kReady);
}

TEST_F(Pool, AScanSetAsideAtStartIsNotSearchedByItsOlderPoints) {
    start();
    const auto k = put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    pool.reset();
    put("k", 2.0f);
    ASSERT_TRUE(*store.claimJob());
    crashes = {{k.id, 2}};
    ASSERT_TRUE(store.recoverJobs(2, crashes));
    ASSERT_TRUE(*store.claimJob());  // second crash
    ASSERT_TRUE(index.loadAll());    // as a server does before it starts its workers
    ASSERT_TRUE((*index.byName("parts"))->signatures.find(k.id));
    start();
    EXPECT_EQ(shape("k").state, store::ShapeState::kFailed);
    EXPECT_EQ(store.getSignature(k.id).error().code, ErrorCode::kNotReady);
    EXPECT_FALSE((*index.byName("parts"))->signatures.find(k.id));
}

TEST_F(Pool, AServerThatIsKilledOverAndOverFailsNoScan) {
    put("k", 1.0f);
    for (int kill = 0; kill < 10; ++kill) {
        ASSERT_TRUE(*store.claimJob());
        EXPECT_TRUE(store.recoverJobs(2, {})->empty()) << kill;
    }
    start();
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    EXPECT_EQ(shape("k").state, store::ShapeState::kReady);
}

// Three scans were in hand when the server died. Run one at a time, they show which of them was the cause.
TEST_F(Pool, SuspectsRunOneAtATimeAndTheRestTogether) {
    for (int i = 0; i < 3; ++i) put("suspect " + std::to_string(i), 1.0f);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(*store.claimJob());
    for (int i = 0; i < 6; ++i) put("innocent " + std::to_string(i), 2.0f);
    std::atomic<int> inside{0};
    std::atomic<bool> suspectHadCompany{false};
    std::atomic<bool> innocentsMet{false};
    start(
        [&](const PointCloud& points, const ShapeParameters& parameters, const RunContext& context) {
            const int now = ++inside;
            if (points[0].x == 1.0) {
                // Nobody is inside, and nobody else could come in.
                if (now > 1 || !isolation.wouldWait(false) || !isolation.wouldWait(true))
                    suspectHadCompany = true;
            } else {
                if (now > 1) innocentsMet = true;
                eventually([&] { return innocentsMet.load(); });
            }
            --inside;
            return quickDescribe(points, parameters, context);
        },
        3);
    ASSERT_TRUE(eventually([&] { return idle(); }));
    EXPECT_FALSE(suspectHadCompany);
    EXPECT_TRUE(innocentsMet);
    EXPECT_EQ(pool->ingested(), 9u);
}

// A rebuild has a suspect in hand, and nobody may come in.
TEST_F(Pool, PauseDoesNotWaitForTheScanThatKeepsItOut) {
    const std::atomic<bool> never{false};
    for (const bool probing : {true, false}) {
        if (probing) put("k", 1.0f);
        std::optional<CrashIsolation::Pass> suspect(std::in_place, isolation, true, never);
        if (probing) {
            start();
        } else {
            put("l", 2.0f);
            ASSERT_TRUE(eventually([&] { return pool->running() == 1; }));
        }
        ASSERT_TRUE(eventually([&] { return isolation.waiting() == 1; }));
        pool->pause();
        EXPECT_EQ(pool->running(), 0u);
        EXPECT_EQ(store.queueDepth()->jobs, 1u) << "put back";
        suspect.reset();
        ASSERT_TRUE(pool->resume(Content::kSame));
        ASSERT_TRUE(eventually([&] { return idle(); }));
    }
    EXPECT_EQ(shape("k").state, store::ShapeState::kReady);
    EXPECT_EQ(shape("l").state, store::ShapeState::kReady);
}

// The store fails now and then: everything is done in the end, nothing twice.
TEST_F(Pool, StoreFailuresAreOutlived) {
    Random random(1);  // called under the store's lock
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        const bool worker = function == "claimJob" || function == "loadPoints" || function == "finishJob" ||
                            function == "releaseJob" || function == "failJob" || function == "getSignature";
        if (worker && random.below(3) == 0) return Error{ErrorCode::kStorage, "now and then"};
        return std::nullopt;
    };
    start();
    for (int i = 0; i < 30; ++i) put(std::to_string(i), static_cast<float>(i % 5 == 0 ? -1 - i : 1 + i));
    ASSERT_TRUE(eventually([&] { return store.queueDepth()->jobs == 0; }));
    store.fault = nullptr;
    pool->stop();
    ASSERT_TRUE(index.reload(parts.id));
    for (int i = 0; i < 30; ++i) {
        EXPECT_EQ(shape(std::to_string(i)).state,
                  i % 5 == 0 ? store::ShapeState::kFailed : store::ShapeState::kReady);
    }
    EXPECT_EQ((*index.byName("parts"))->signatures.size(), 24u);
}

// The worker that could not store a result rests while another has the job again.
TEST_F(Pool, ARestingWorkerDoesNotHideTheNextOneWithItsJob) {
    const auto x = put("x", 1.0f);
    put("y", 2.0f);
    std::atomic<bool> failOnce{true};
    std::atomic<bool> yMayEnd{false};
    std::atomic<bool> xMayEnd{false};
    std::atomic<int> visitsOfX{0};
    std::atomic<int> visitsOfY{0};
    std::atomic<int> left{0};
    std::atomic<int> claims{0};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function == "claimJob") ++claims;
        if (function == "finishJob" && failOnce.exchange(false)) return Error{ErrorCode::kStorage, "once"};
        return std::nullopt;
    };
    backOff = 300ms;
    start([&](const PointCloud& points, const ShapeParameters& parameters, const RunContext& context) {
        if (points[0].x != 1.0) {
            ++visitsOfY;
            eventually([&] { return yMayEnd.load(); });
        } else if (++visitsOfX == 1) {
            eventually([&] { return visitsOfY > 0; });  // the other worker is busy
        } else {
            eventually([&] { return xMayEnd.load(); });
            ++left;
        }
        return quickDescribe(points, parameters, context);
    });
    ASSERT_TRUE(eventually([&] { return log->all().find("cannot store a signature") != std::string::npos; }));
    yMayEnd = true;  // its worker takes x
    ASSERT_TRUE(eventually([&] { return settled("y") && visitsOfX == 2; }));
    // Of x, of y, of x again, and of nothing by the other worker.
    ASSERT_TRUE(eventually([&] { return claims == 4; }));
    EXPECT_EQ(pool->running(), 1u) << "the rest of the first worker is over, x is still in hand";
    pool->supersede(x.id);
    std::atomic<bool> paused{false};
    std::thread pausing([&] {
        pool->pause();
        paused = true;
    });
    EXPECT_TRUE(eventually([&] { return pool->pauseWaits(); }));
    EXPECT_FALSE(paused) << "while a worker has x in hand";
    EXPECT_EQ(left, 0);
    xMayEnd = true;
    pausing.join();
    EXPECT_EQ(left, 1);
    EXPECT_EQ(shape("x").state, store::ShapeState::kFailed) << "its worker was told that x is superseded";
}

TEST_F(Pool, DamagedPointsFailTheShape) {
    store.fault = [](const std::string& function) -> std::optional<Error> {
        if (function == "loadPoints") return Error{ErrorCode::kDataLoss, "checksum of the points"};
        return std::nullopt;
    };
    start();
    put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    EXPECT_EQ(shape("k").failure->code, ErrorCode::kDataLoss);
}

// A job that was segmented with the parameters of before a rebuild is segmented again.
TEST_F(Pool, ResultOfOldParametersIsNeverStored) {
    Gate gate;
    start(through(gate), 1);
    put("k", 1.0f);
    ASSERT_TRUE(eventually([&] { return gate.entered() == 1; }));
    const auto rebuild = store.startRebuild(parts.id, paperParameters(3));
    ASSERT_TRUE(rebuild);
    const auto switched = index.switchGeneration(parts.id, [&] { return store.finishRebuild(rebuild->id); });
    ASSERT_TRUE(switched && *switched);
    gate.open();
    ASSERT_TRUE(eventually([&] { return settled("k"); }));
    const auto row = store.getSignature(shape("k").id);
    ASSERT_TRUE(row);
    EXPECT_EQ(row->generation, 2);
    EXPECT_EQ(decodeSignature(row->bytes)->scale, 3.0) << "made with the new parameters";
}

TEST_F(Pool, WatchersAreToldAfterTheIndexHasTheSignature) {
    Gate gate;
    start(through(gate), 1);
    const auto k = put("k", 1.0f);
    const auto watch = board.watch(k.id);
    ASSERT_TRUE(eventually([&] { return gate.entered() == 1; }));
    // Refreshing the index reads the signature; no watcher may have been told before.
    std::atomic<bool> refreshed{false};
    std::atomic<bool> toldTooEarly{false};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function == "getSignature") {
            refreshed = true;
            if (watch->status().stage == "queued") toldTooEarly = true;
        }
        return std::nullopt;
    };
    gate.open();
    for (auto status = watch->status(); status.stage != "queued"; status = watch->status()) {
        watch->waitForChange(status.sequence, ProgressBoard::Clock::now() + 10s);
    }
    EXPECT_TRUE((*index.byName("parts"))->signatures.find(k.id)) << "the moment the watcher is told";
    EXPECT_TRUE(refreshed);
    EXPECT_FALSE(toldTooEarly);
    pool->stop();
}

TEST_F(Pool, RetryHintIsProportionalToTheQueueWithinBounds) {
    const auto& one = start(quickDescribe, 1);
    const auto hint = one.retryAfter(100);
    EXPECT_EQ(hint, 10s) << "a tenth of the queue, at a second per job until there are measurements";
    EXPECT_EQ(one.retryAfter(200), 2 * hint);
    EXPECT_EQ(one.retryAfter(10), hint / 10);
    EXPECT_EQ(one.retryAfter(0), one.retryAfter(10)) << "at least one place";
    EXPECT_EQ(one.retryAfter(1'000'000'000), 60s);
}

TEST_F(Pool, RetryHintFallsWithMoreThreadsAndFasterJobs) {
    const auto& four = start(quickDescribe, 4);
    EXPECT_EQ(four.retryAfter(100), 2500ms);
    for (int i = 0; i < 20; ++i) put(std::to_string(i), 1.0f);
    ASSERT_TRUE(eventually([&] { return idle(); }));
    EXPECT_LT(four.retryAfter(100), 1000ms) << "twenty jobs took far less than a second each";
    EXPECT_GE(four.retryAfter(0), 100ms);
}

}  // namespace
}  // namespace shapedb::ingest
