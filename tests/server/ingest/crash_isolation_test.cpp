// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/crash_isolation.h"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/support/fixtures.h"

namespace shapedb::ingest {
namespace {

using testing::eventually;

const std::atomic<bool> kNotCancelled{false};

TEST(CrashIsolation, SuspectsAreAlone) {
    CrashIsolation gate;
    std::atomic<int> ordinary{0};
    std::atomic<int> suspects{0};
    std::atomic<bool> together{false};
    std::vector<std::thread> threads;
    for (int t = 0; t < 6; ++t) {
        threads.emplace_back([&, t] {
            const bool suspect = t % 3 == 0;
            for (int i = 0; i < 200; ++i) {
                const CrashIsolation::Pass pass(gate, suspect, kNotCancelled);
                ++(suspect ? suspects : ordinary);
                if (suspects > 1 || (suspects == 1 && ordinary > 0)) together = true;
                std::this_thread::yield();
                --(suspect ? suspects : ordinary);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_FALSE(together);
}

TEST(CrashIsolation, OrdinaryScansRunTogether) {
    CrashIsolation gate;
    auto first = std::make_unique<CrashIsolation::Pass>(gate, false, kNotCancelled);
    std::atomic<bool> secondIn{false};
    std::thread other([&] {
        const CrashIsolation::Pass second(gate, false, kNotCancelled);
        secondIn = true;
    });
    EXPECT_TRUE(eventually([&] { return secondIn.load(); })) << "while the first is still inside";
    first.reset();
    other.join();
}

TEST(CrashIsolation, WaitingSuspectKeepsNewOrdinaryScansOut) {
    CrashIsolation gate;
    auto first = std::make_unique<CrashIsolation::Pass>(gate, false, kNotCancelled);
    EXPECT_FALSE(gate.wouldWait(false));
    EXPECT_TRUE(gate.wouldWait(true));
    std::atomic<bool> suspectIn{false};
    std::atomic<bool> letSuspectGo{false};
    std::thread suspect([&] {
        const CrashIsolation::Pass pass(gate, true, kNotCancelled);
        suspectIn = true;
        eventually([&] { return letSuspectGo.load(); });
    });
    EXPECT_TRUE(eventually([&] { return gate.wouldWait(false); })) << "the suspect is waiting";
    EXPECT_FALSE(suspectIn);
    first.reset();
    EXPECT_TRUE(eventually([&] { return suspectIn.load(); }));
    EXPECT_TRUE(gate.wouldWait(false));
    EXPECT_TRUE(gate.wouldWait(true));
    letSuspectGo = true;
    suspect.join();
    EXPECT_FALSE(gate.wouldWait(false));
    EXPECT_FALSE(gate.wouldWait(true));
}

TEST(CrashIsolation, CancellingEndsTheWait) {
    CrashIsolation gate;
    for (const bool suspect : {false, true}) {
        const CrashIsolation::Pass inside(gate, true, kNotCancelled);
        std::atomic<bool> cancel{false};
        std::atomic<bool> admitted{true};
        std::thread waiting([&] { admitted = CrashIsolation::Pass(gate, suspect, cancel).admitted(); });
        EXPECT_TRUE(eventually([&] { return gate.waiting() == 1; }));
        cancel = true;
        waiting.join();
        EXPECT_FALSE(admitted);
        EXPECT_TRUE(gate.wouldWait(false)) << "the first is still inside";
    }
    EXPECT_FALSE(gate.wouldWait(false)) << "neither of those who gave up left a trace";
    EXPECT_FALSE(gate.wouldWait(true));
}

}  // namespace
}  // namespace shapedb::ingest
