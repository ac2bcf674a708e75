// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/rebuild_driver.h"

#include <atomic>
#include <cstdio>
#include <fstream>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/base/random.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::ingest {
namespace {

using namespace shapedb::testing;
using namespace std::chrono_literals;

class Driver : public ::testing::Test {
  protected:
    Driver() : log(std::make_shared<RecordingLogger>()), index(store, log) {
        parts = *store.createCollection("parts", "", paperParameters());
        EXPECT_TRUE(index.loadAll());
        WorkerOptions options;
        options.threads = 1;
        options.backOff = 5ms;
        pool = std::make_unique<WorkerPool>(store, index, board, isolation, quickDescribe, log, options);
        EXPECT_TRUE(pool->start());
    }

    void fill(int count) {
        for (int i = 0; i < count; ++i) put(std::to_string(i), static_cast<float>(i + 1));
        pool->wake();
        ASSERT_TRUE(eventually([&] { return store.queueDepth()->jobs == 0 && pool->running() == 0; }));
    }

    void put(const std::string& key, float tag) {
        const auto points = taggedPoints(tag);
        ASSERT_TRUE(store.putShape(putRequest(parts.id, key, points)));
    }

    RebuildDriver& start(SignaturePipeline describe = quickDescribe, int threads = 3) {
        RebuildOptions options;
        options.threads = threads;
        options.batch = 4;
        options.backOff = 5ms;
        options.yield = 1ms;
        options.journalPath = journal;
        options.crashes = crashes;
        describe.pauseWithoutMemory({});
        driver = std::make_unique<RebuildDriver>(store, index, *pool, isolation, std::move(describe), log,
                                                 options);
        EXPECT_TRUE(driver->start());
        return *driver;
    }

    /// Counts what it describes; waits at each scan while closed.
    SignaturePipeline counting() {
        return
            [this](const PointCloud& points, const ShapeParameters& parameters, const RunContext& context) {
                ++described;
                while (closed && described > freeScans) {
                    if (const auto go = context.checkpoint(); !go)
                        return Result<Description>(fail(go.error()));
                    std::this_thread::sleep_for(1ms);
                }
                return quickDescribe(points, parameters, context);
            };
    }

    static ShapeParameters parametersWith(std::uint32_t maxPoints) {
        ShapeParameters parameters = parametersOf(Profile::kPaper);
        parameters.signature.maxPoints = maxPoints;
        return parameters;
    }

    store::Rebuild begin(std::uint32_t maxPoints = 3) {
        const auto rebuild = driver->begin((*index.byName("parts"))->collection, parametersWith(maxPoints));
        EXPECT_TRUE(rebuild);
        return *rebuild;
    }

    store::Rebuild finished(store::Rebuild rebuild) {
        while (rebuild.state == store::RebuildState::kRunning) {
            RunContext context;
            context.deadline = RunContext::Clock::now() + 20s;
            const auto next = driver->waitForChange(rebuild, context);
            if (!next) {
                ADD_FAILURE() << next.error().message;
                return rebuild;
            }
            rebuild = *next;
        }
        return rebuild;
    }

    std::int64_t generation() { return (*index.byName("parts"))->collection.generation; }

    void expectAllOf(std::uint32_t maxPoints) {
        const auto snapshot = *index.byName("parts");
        EXPECT_EQ(snapshot->parameters.signature.maxPoints, maxPoints);
        const auto shapes = store.listShapes(parts.id, 0, 1'000, {});
        for (const auto& shape : *shapes) {
            const auto place = snapshot->signatures.find(shape.id);
            ASSERT_TRUE(place) << shape.key;
            EXPECT_EQ(place.block->scale(place.row), maxPoints) << shape.key;
        }
    }

    MemoryStore store;
    std::shared_ptr<RecordingLogger> log;
    index::CollectionIndex index;
    ProgressBoard board;
    CrashIsolation isolation;
    store::Collection parts;
    std::unique_ptr<WorkerPool> pool;
    std::unique_ptr<RebuildDriver> driver;
    std::string journal;
    std::vector<store::Crash> crashes;
    std::atomic<bool> closed{false};
    std::atomic<int> described{0};
    std::atomic<int> freeScans{0};
};

TEST_F(Driver, RebuildsEverythingIntoTheNextGeneration) {
    fill(25);
    start(counting());
    const auto done = finished(begin());
    EXPECT_EQ(done.state, store::RebuildState::kDone);
    EXPECT_EQ(described, 25) << "each shape once";
    ASSERT_TRUE(eventually([&] { return generation() == 2; }));
    expectAllOf(3);
}

TEST_F(Driver, EmptyCollectionIsDoneAtOnce) {
    start();
    EXPECT_EQ(finished(begin()).state, store::RebuildState::kDone);
    ASSERT_TRUE(eventually([&] { return generation() == 2; }));
}

TEST_F(Driver, RecordsFailuresAndContinues) {
    fill(5);
    put("bad", -1.0f);
    pool->wake();
    ASSERT_TRUE(eventually([&] { return store.queueDepth()->jobs == 0; }));
    start();
    const auto done = finished(begin());
    EXPECT_EQ(done.done, 6u);
    EXPECT_EQ(done.failed, 1u);
    EXPECT_EQ(store.getShape(parts.id, "bad")->failure->code, ErrorCode::kNoInterior);
}

TEST_F(Driver, ExceptionsBecomeFailures) {
    fill(3);
    start([](const PointCloud& points, const ShapeParameters& parameters,
             const RunContext& context) -> Result<Description> {
        if (points[0].x == 2.0) throw std::bad_alloc();
        if (points[0].x == 3.0) throw std::runtime_error("surprise");
        return quickDescribe(points, parameters, context);
    });
    EXPECT_EQ(finished(begin()).failed, 2u);
    EXPECT_NE(log->all().find("scan cannot be segmented again error=out_of_memory"), std::string::npos)
        << log->all();
    EXPECT_NE(log->all().find("surprise"), std::string::npos) << log->all();
    EXPECT_EQ(store.getShape(parts.id, "1")->state, store::ShapeState::kReady) << "as found before";
}

TEST_F(Driver, FollowsARebuildWithTheSameParametersOnly) {
    fill(5);
    closed = true;
    start(counting());
    const auto first = begin(3);
    EXPECT_EQ(begin(3).id, first.id);
    const auto other = driver->begin((*index.byName("parts"))->collection, parametersWith(4));
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::kRejected);
    closed = false;
    EXPECT_EQ(finished(first).state, store::RebuildState::kDone);
}

TEST_F(Driver, CancelDropsThePartialResult) {
    fill(10);
    closed = true;
    freeScans = 4;
    start(counting());
    const auto rebuild = begin();
    ASSERT_TRUE(eventually([&] { return store.getRebuild(rebuild.id)->done == 4; }));
    ASSERT_TRUE(driver->cancel(parts));
    EXPECT_EQ(finished(rebuild).state, store::RebuildState::kCancelled);
    EXPECT_EQ(generation(), 1);
    EXPECT_EQ(driver->cancel(parts).error().code, ErrorCode::kNotFound);
    closed = false;
    described = 0;
    EXPECT_EQ(finished(begin(5)).state, store::RebuildState::kDone);
    EXPECT_EQ(described, 10) << "from the beginning";
}

TEST_F(Driver, QueuedRebuildCanBeCancelledToo) {
    fill(3);
    const auto cups = *store.createCollection("cups", "", paperParameters());
    ASSERT_TRUE(index.add(cups));
    closed = true;
    start(counting());
    const auto first = begin();
    const auto second = driver->begin(cups, parametersWith(2));
    ASSERT_TRUE(second);
    ASSERT_TRUE(driver->cancel(cups));
    EXPECT_EQ(store.getRebuild(second->id)->state, store::RebuildState::kCancelled);
    closed = false;
    EXPECT_EQ(finished(first).state, store::RebuildState::kDone);
}

TEST_F(Driver, StopKeepsProgressForTheNextStart) {
    fill(10);
    closed = true;
    freeScans = 6;
    start(counting());
    const auto rebuild = begin();
    ASSERT_TRUE(eventually([&] { return store.getRebuild(rebuild.id)->done == 6; }));
    driver->stop();
    EXPECT_EQ(store.getRebuild(rebuild.id)->state, store::RebuildState::kRunning);
    closed = false;
    described = 0;
    start(counting());
    EXPECT_EQ(finished(rebuild).state, store::RebuildState::kDone);
    EXPECT_EQ(described, 4) << "only the missing ones";
    ASSERT_TRUE(eventually([&] { return generation() == 2; }));
    expectAllOf(3);
}

TEST_F(Driver, PauseAndResume) {
    fill(10);
    closed = true;
    freeScans = 2;
    start(counting());
    const auto rebuild = begin();
    ASSERT_TRUE(eventually([&] { return store.getRebuild(rebuild.id)->done == 2; }));
    driver->pause();
    const int before = described;
    closed = false;
    // While the driver is paused the pool gets ten scans done.
    for (int i = 0; i < 10; ++i) put("meanwhile " + std::to_string(i), 1.0f);
    pool->wake();
    ASSERT_TRUE(eventually([&] { return store.queueDepth()->jobs == 0; }));
    EXPECT_EQ(described, before);
    ASSERT_TRUE(driver->resume(Content::kSame));
    EXPECT_EQ(finished(rebuild).state, store::RebuildState::kDone);
}

TEST_F(Driver, HandlesShapesAddedAndDeletedMeanwhile) {
    fill(10);
    closed = true;
    freeScans = 5;
    start(counting());
    const auto rebuild = begin();
    ASSERT_TRUE(eventually([&] { return store.getRebuild(rebuild.id)->done == 5; }));
    ASSERT_TRUE(store.deleteShape(parts.id, "9", std::nullopt));
    put("0", 50.0f);    // replaced after it was rebuilt
    put("new", 60.0f);  // added with the old parameters
    pool->wake();
    ASSERT_TRUE(eventually([&] { return store.queueDepth()->jobs == 0; }));
    closed = false;
    EXPECT_EQ(finished(rebuild).state, store::RebuildState::kDone);
    ASSERT_TRUE(eventually([&] { return generation() == 2; }));
    expectAllOf(3);
    const auto snapshot = *index.byName("parts");
    EXPECT_EQ(snapshot->signatures.size(), 10u);
    EXPECT_EQ(cachedVolume(snapshot->signatures, store.getShape(parts.id, "0")->id), 50.0);
}

TEST_F(Driver, RetriesAfterStoreErrors) {
    fill(12);
    Random random(1);  // called under the store's lock
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        const bool ours = function == "rebuildBatch" || function == "loadPoints" ||
                          function == "putRebuilt" || function == "finishRebuild";
        if (ours && random.below(3) == 0) return Error{ErrorCode::kStorage, "now and then"};
        return std::nullopt;
    };
    start();
    EXPECT_EQ(finished(begin()).state, store::RebuildState::kDone);
    store.fault = nullptr;
    ASSERT_TRUE(eventually([&] { return generation() == 2; }));
    expectAllOf(3);
}

// After it is done its state cannot be read once: the driver finds out with the next shapes.
TEST_F(Driver, ARebuildThatIsDoneMakesRoomForTheNext) {
    fill(3);
    std::atomic<bool> finishing{false};
    std::atomic<bool> failed{false};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function == "finishRebuild") finishing = true;
        if (function == "getRebuild" && finishing && !failed.exchange(true))
            return Error{ErrorCode::kStorage, "once"};
        return std::nullopt;
    };
    start(quickDescribe, 1);
    const auto first = begin();
    ASSERT_TRUE(eventually([&] { return failed.load(); }));
    const auto cups = *store.createCollection("cups", "", paperParameters());
    ASSERT_TRUE(index.add(cups));
    const auto second = driver->begin(cups, parametersWith(2));
    ASSERT_TRUE(second);
    EXPECT_EQ(finished(*second).state, store::RebuildState::kDone);
    EXPECT_EQ(store.getRebuild(first.id)->state, store::RebuildState::kDone);
    EXPECT_EQ(store.rebuildBatch(first.id, 0, 1).error().code, ErrorCode::kRejected);
}

TEST_F(Driver, DeletedCollectionEndsItsRebuild) {
    fill(5);
    closed = true;
    start(counting());
    const auto rebuild = begin();
    ASSERT_TRUE(eventually([&] { return described > 0; }));
    ASSERT_TRUE(driver->cancel(parts));
    ASSERT_TRUE(store.deleteCollection(parts.id));
    index.remove(parts.id);
    RunContext context;
    EXPECT_EQ(driver->waitForChange(rebuild, context).error().code, ErrorCode::kNotFound);
    const auto cups = *store.createCollection("cups", "", paperParameters());
    ASSERT_TRUE(index.add(cups));
    const auto next = driver->begin(cups, parametersWith(2));
    ASSERT_TRUE(next);
    EXPECT_EQ(finished(*next).state, store::RebuildState::kDone);
}

// After a process died twice over one scan, that scan is quarantined and the rebuild ends.
TEST_F(Driver, QuarantinesAScanThatCrashesTheServerTwice) {
    fill(5);
    journal = ::testing::TempDir() + "shapedb-rebuild-journal-" + std::to_string(::getpid());
    const auto guilty = *store.getShape(parts.id, "2");
    const auto suspected = *store.getShape(parts.id, "3");
    std::ofstream(journal) << "shapedb rebuild journal 2\n"
                           << guilty.id << " 1 1 0 1\n"
                           << suspected.id << " 1 0 0 1\n";
    crashes = {{guilty.id, 1}};
    start(counting());
    const auto done = finished(begin());
    EXPECT_EQ(done.state, store::RebuildState::kDone);
    EXPECT_EQ(done.failed, 1u);
    EXPECT_EQ(described, 4) << "it was not tried again";
    EXPECT_EQ(store.getShape(parts.id, "2")->state, store::ShapeState::kReady) << "its old signature serves";
    EXPECT_EQ(store.getSignature(guilty.id)->generation, 2);
    EXPECT_NE(log->all().find("crashed the server 2 times"), std::string::npos) << log->all();
    EXPECT_EQ(store.getShape(parts.id, "3")->state, store::ShapeState::kReady);
    EXPECT_EQ(finished(begin(4)).failed, 0u) << "the next rebuild tries it again";
    driver.reset();
    std::ifstream left(journal);
    std::string content{std::istreambuf_iterator<char>(left), {}};
    EXPECT_EQ(content, "shapedb rebuild journal 2\n");
    std::remove(journal.c_str());
}

TEST_F(Driver, OnlyReplacedContentForgetsDeaths) {
    fill(2);
    journal = ::testing::TempDir() + "shapedb-rebuild-journal-" + std::to_string(::getpid());
    const auto guilty = *store.getShape(parts.id, "1");
    const auto deaths = [&] { return CrashJournal(journal, {}, log).deaths(guilty).crashes; };
    std::ofstream(journal) << "shapedb rebuild journal 2\n" << guilty.id << " 1 1 0 0\n";
    start();
    driver->pause();
    ASSERT_TRUE(driver->resume(Content::kSame));
    EXPECT_EQ(deaths(), 1) << "after a restore that failed";
    driver->pause();
    ASSERT_TRUE(driver->resume(Content::kReplaced));
    EXPECT_EQ(deaths(), 0);
    std::remove(journal.c_str());
}

// A worker has a suspect in hand, and nobody may come in.
TEST_F(Driver, PauseDoesNotWaitForTheScanThatKeepsItOut) {
    fill(2);
    start(counting());
    const std::atomic<bool> never{false};
    std::optional<CrashIsolation::Pass> suspect(std::in_place, isolation, true, never);
    const auto rebuild = begin();
    ASSERT_TRUE(eventually([&] { return isolation.waiting() > 0; }));
    driver->pause();
    EXPECT_EQ(described, 0);
    suspect.reset();
    ASSERT_TRUE(driver->resume(Content::kSame));
    EXPECT_EQ(finished(rebuild).state, store::RebuildState::kDone);
    EXPECT_EQ(described, 2);
}

TEST_F(Driver, AbandonsARebuildWithUnreadableParameters) {
    ASSERT_TRUE(store.startRebuild(parts.id, "not parameters"));
    start();
    ASSERT_TRUE(eventually([&] { return store.runningRebuilds()->empty(); }));
    EXPECT_NE(log->all().find("rebuild abandoned"), std::string::npos) << log->all();
}

TEST_F(Driver, PauseWaitsForARebuildThatIsBeingGivenUp) {
    ASSERT_TRUE(store.startRebuild(parts.id, "not parameters"));
    std::atomic<bool> abandoning{false};
    std::atomic<bool> mayEnd{false};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function != "abandonRebuild") return std::nullopt;
        abandoning = true;
        eventually([&] { return mayEnd.load(); });
        return std::nullopt;
    };
    start();
    ASSERT_TRUE(eventually([&] { return abandoning.load(); }));
    std::atomic<bool> paused{false};
    std::thread pausing([&] {
        driver->pause();
        paused = true;
    });
    EXPECT_TRUE(eventually([&] { return driver->pauseWaits(); }));
    EXPECT_FALSE(paused) << "while a thread uses the store";
    mayEnd = true;
    pausing.join();
    EXPECT_TRUE(store.runningRebuilds()->empty());
}

TEST_F(Driver, ARebuildThatCannotBeGivenUpIsTriedAgain) {
    ASSERT_TRUE(store.startRebuild(parts.id, "not parameters"));
    std::atomic<bool> failed{false};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function == "abandonRebuild" && !failed.exchange(true)) return Error{ErrorCode::kStorage, "once"};
        return std::nullopt;
    };
    start();
    EXPECT_TRUE(eventually([&] { return store.runningRebuilds()->empty(); }));
}

TEST_F(Driver, CancelledWaitDoesNotStopTheRebuild) {
    fill(3);
    closed = true;
    start(counting());
    auto rebuild = begin();
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(driver->waitForChange(rebuild, context).error().code, ErrorCode::kCancelled);
    RunContext late;
    late.deadline = RunContext::Clock::now() + 20ms;
    EXPECT_EQ(driver->waitForChange(*store.getRebuild(rebuild.id), late).error().code,
              ErrorCode::kDeadlineExceeded);
    closed = false;
    EXPECT_EQ(finished(rebuild).state, store::RebuildState::kDone);
}

}  // namespace
}  // namespace shapedb::ingest
