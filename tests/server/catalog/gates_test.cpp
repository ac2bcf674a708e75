// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/gates.h"

#include <future>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/eventually.h"

namespace shapedb::catalog {
namespace {

using namespace std::chrono_literals;

using security::CallClass;

TEST(CallGate, RefusesOnceDraining) {
    CallGate gate({10, 10, 10});
    ASSERT_TRUE(gate.enter(CallClass::kOrdinary));
    EXPECT_FALSE(gate.draining());
    gate.drain();
    EXPECT_TRUE(gate.draining());
    EXPECT_EQ(gate.enter(CallClass::kAdmin).error().code, ErrorCode::kUnavailable);
    EXPECT_FALSE(gate.waitUntilEmpty(std::chrono::steady_clock::now() + 10ms));
    std::thread call([&] {
        std::this_thread::sleep_for(10ms);
        gate.leave(CallClass::kOrdinary);
    });
    EXPECT_TRUE(gate.waitUntilEmpty(std::chrono::steady_clock::now() + 10s));
    call.join();
}

TEST(CallGate, NoKindOfCallShutsTheOthersOut) {
    CallGate gate({4, 2, 1, 1});
    ASSERT_TRUE(gate.enter(CallClass::kUpload));
    ASSERT_TRUE(gate.enter(CallClass::kUpload));
    const auto third = gate.enter(CallClass::kUpload);
    ASSERT_FALSE(third);
    EXPECT_EQ(third.error().code, ErrorCode::kQueueFull);
    EXPECT_EQ(third.error().message,
              "all of the 2 places for uploads (limits.max_uploads) are taken: try again later");

    ASSERT_TRUE(gate.enter(CallClass::kOrdinary));
    ASSERT_TRUE(gate.enter(CallClass::kOrdinary));
    EXPECT_FALSE(gate.enter(CallClass::kOrdinary)) << "uploads are ordinary calls too";
    ASSERT_TRUE(gate.enter(CallClass::kAdmin)) << "administrators have places of their own";
    EXPECT_FALSE(gate.enter(CallClass::kAdmin));

    gate.leave(CallClass::kUpload);
    EXPECT_TRUE(gate.enter(CallClass::kUpload));
    gate.leave(CallClass::kAdmin);
    EXPECT_TRUE(gate.enter(CallClass::kAdmin));
}

TEST(CallGate, WhatLastsLeavesPlacesForAdministrators) {
    CallGate gate({4, 2, 3, 2});
    ASSERT_TRUE(gate.enter(CallClass::kAdminLong));
    ASSERT_TRUE(gate.enter(CallClass::kAdminLong));
    const auto third = gate.enter(CallClass::kAdminLong);
    ASSERT_FALSE(third);
    EXPECT_EQ(third.error().code, ErrorCode::kQueueFull);
    EXPECT_EQ(third.error().message,
              "all of the 2 places for rebuilds, checks and copies are taken: try again later");
    ASSERT_TRUE(gate.enter(CallClass::kAdmin)) << "such as one that revokes a key";
    EXPECT_FALSE(gate.enter(CallClass::kAdmin));

    gate.leave(CallClass::kAdminLong);
    EXPECT_TRUE(gate.enter(CallClass::kAdmin)) << "of all places";
    EXPECT_FALSE(gate.enter(CallClass::kAdminLong));
    gate.leave(CallClass::kAdmin);
    EXPECT_TRUE(gate.enter(CallClass::kAdminLong));
    for (const CallClass kind : {CallClass::kAdminLong, CallClass::kAdminLong, CallClass::kAdmin}) {
        gate.leave(kind);
    }
    EXPECT_EQ(gate.running().admin, 0);
    EXPECT_EQ(gate.running().longAdmin, 0);
}

TEST(SegmentationSlots, LimitsConcurrentHolders) {
    SegmentationSlots slots(2);
    std::atomic<int> inside{0};
    std::atomic<int> most{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 8; ++t) {
        threads.emplace_back([&] {
            for (int i = 0; i < 20; ++i) {
                SegmentationSlots::Slot slot(slots);
                ASSERT_TRUE(slot.acquire({}));
                const int now = ++inside;
                int seen = most.load();
                while (now > seen && !most.compare_exchange_weak(seen, now)) {
                }
                // The first holder waits for a second one, so that two are known to be inside at once.
                EXPECT_TRUE(shapedb::testing::eventually([&] { return most.load() >= 2; }));
                --inside;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(most, 2);
}

TEST(SegmentationSlots, WaitEndsOnCancelOrDeadline) {
    SegmentationSlots slots(1);
    {
        SegmentationSlots::Slot taken(slots);
        ASSERT_TRUE(taken.acquire({}));
        RunContext late;
        late.deadline = RunContext::Clock::now() + 20ms;
        SegmentationSlots::Slot second(slots);
        EXPECT_EQ(second.acquire(late).error().code, ErrorCode::kDeadlineExceeded);
        std::atomic<bool> cancel{true};
        RunContext cancelled;
        cancelled.cancel = &cancel;
        SegmentationSlots::Slot third(slots);
        EXPECT_EQ(third.acquire(cancelled).error().code, ErrorCode::kCancelled);
    }
    SegmentationSlots::Slot free(slots);
    RunContext soon;
    soon.deadline = RunContext::Clock::now() + 10s;
    EXPECT_TRUE(free.acquire(soon)) << "a caller that gave up holds no slot";
}

TEST(RestoreGate, AdmitsOneRestoreAndRaisesTheEpoch) {
    RestoreGate gate;
    const auto before = gate.epoch();
    ASSERT_TRUE(gate.beginRestore());
    EXPECT_EQ(gate.requireNoRestore().error().code, ErrorCode::kUnavailable);
    EXPECT_EQ(gate.beginRestore().error().code, ErrorCode::kRejected);
    gate.replaced();
    gate.endRestore();
    EXPECT_GT(gate.epoch(), before);
    EXPECT_TRUE(gate.beginRestore());
}

TEST(RestoreGate, WaitsForRunningWrites) {
    RestoreGate gate;
    std::unique_lock<std::shared_mutex> restore = gate.exclusive();
    restore.unlock();
    // On a thread of its own: no thread may try a lock that it holds shared.
    const auto wouldWait = [&] {
        return std::async(std::launch::async,
                          [&] {
                              if (!restore.try_lock()) return true;
                              restore.unlock();
                              return false;
                          })
            .get();
    };
    {
        const RestoreGate::Write write(gate);
        EXPECT_TRUE(wouldWait());
    }
    EXPECT_TRUE(gate.exclusive().owns_lock()) << "and ends when the write is done";
}

}  // namespace
}  // namespace shapedb::catalog
