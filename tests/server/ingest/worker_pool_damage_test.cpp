// SPDX-License-Identifier: GPL-3.0-or-later
// Workers whose queue, or whose collections, are damaged.
#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "server/ingest/worker_pool.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::ingest {
namespace {

using namespace shapedb::testing;
using namespace std::chrono_literals;

WorkerOptions quickOptions() {
    WorkerOptions options;
    options.backOff = 1ms;
    return options;
}

/// Until a pool that does ask again, since its store fails for other reasons, has done so this often.
void waitForBackOffs(int times) {
    MemoryStore failing;
    std::atomic<int> asked{0};
    failing.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function != "claimJob") return std::nullopt;
        ++asked;
        return Error{ErrorCode::kStorage, "the disk is busy"};
    };
    const auto log = std::make_shared<RecordingLogger>();
    index::CollectionIndex index(failing, log);
    ProgressBoard board;
    CrashIsolation isolation;
    WorkerPool another(failing, index, board, isolation, quickDescribe, log, quickOptions());
    ASSERT_TRUE(another.start());
    ASSERT_TRUE(eventually([&] { return asked >= times; }));
}

class PoolOfDamage : public ::testing::Test {
  protected:
    PoolOfDamage() : log(std::make_shared<RecordingLogger>()), index(store, log) {
        parts = *store.createCollection("parts", "", paperParameters());
        EXPECT_TRUE(index.loadAll());
    }

    void start() {
        pool =
            std::make_unique<WorkerPool>(store, index, board, isolation, quickDescribe, log, quickOptions());
        EXPECT_TRUE(pool->start());
    }
    void put(const std::string& key, float tag) {
        EXPECT_TRUE(store.putShape(putRequest(parts.id, key, taggedPoints(tag))));
    }
    bool settled(const std::string& key) {
        return store.getShape(parts.id, key)->state != store::ShapeState::kPending;
    }

    MemoryStore store;
    std::shared_ptr<RecordingLogger> log;
    index::CollectionIndex index;
    ProgressBoard board;
    CrashIsolation isolation;
    store::Collection parts;
    std::unique_ptr<WorkerPool> pool;
};

TEST_F(PoolOfDamage, ADamagedQueueTakesTheWorkersOutOfServiceUntilARestore) {
    put("a", 1.0f);
    std::atomic<int> asked{0};
    std::atomic<bool> damaged{true};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function == "claimJob") ++asked;
        if (!damaged || (function != "recoverJobs" && function != "claimJob")) return std::nullopt;
        return Error{ErrorCode::kDataLoss, "a page of table job is malformed"};
    };
    start();
    ASSERT_TRUE(pool->trouble());
    EXPECT_NE(pool->trouble()->message.find("table job"), std::string::npos) << pool->trouble()->message;
    waitForBackOffs(20);
    EXPECT_EQ(asked, 0) << "it does not try again and again";
    pool->pause();
    damaged = false;
    ASSERT_TRUE(pool->resume(Content::kReplaced));
    EXPECT_FALSE(pool->trouble());
    EXPECT_TRUE(eventually([&] { return settled("a"); }));
}

TEST_F(PoolOfDamage, DamageFoundLaterTakesThemOutOfServiceToo) {
    std::atomic<int> asked{0};
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function != "claimJob") return std::nullopt;
        ++asked;
        return Error{ErrorCode::kDataLoss, "a page of table job is malformed"};
    };
    start();
    EXPECT_TRUE(eventually([&] { return pool->trouble().has_value(); }));
    const int before = asked;
    waitForBackOffs(20);
    EXPECT_EQ(asked, before);
}

TEST_F(PoolOfDamage, NothingIsSegmentedWithParametersThatAreUnknown) {
    const auto broken = *store.createCollection("broken", "", "{}");
    ASSERT_TRUE(index.loadAll());
    ASSERT_TRUE(store.putShape(putRequest(broken.id, "a", taggedPoints(1.0f))));
    put("b", 2.0f);
    start();
    EXPECT_TRUE(eventually([&] { return settled("b"); }));
    const auto failed = *store.getShape(broken.id, "a");
    ASSERT_EQ(failed.state, store::ShapeState::kFailed);
    EXPECT_EQ(failed.failure->code, ErrorCode::kDataLoss);
}

}  // namespace
}  // namespace shapedb::ingest
