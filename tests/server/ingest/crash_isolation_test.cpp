#include "server/ingest/crash_isolation.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb::ingest {
namespace {

using namespace std::chrono_literals;

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
                const CrashIsolation::Pass pass(gate, suspect);
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

TEST(CrashIsolation, OrdinaryOnesAreTogether) {
    CrashIsolation gate;
    const CrashIsolation::Pass first(gate, false);
    const CrashIsolation::Pass second(gate, false);
}

TEST(CrashIsolation, WaitingSuspectGetsItsTurn) {
    CrashIsolation gate;
    auto first = std::make_unique<CrashIsolation::Pass>(gate, false);
    std::atomic<bool> suspectIn{false};
    std::atomic<bool> lateIn{false};
    std::thread suspect([&] {
        const CrashIsolation::Pass pass(gate, true);
        suspectIn = true;
        std::this_thread::sleep_for(20ms);
        EXPECT_FALSE(lateIn);
    });
    std::this_thread::sleep_for(20ms);
    std::thread late([&] {
        const CrashIsolation::Pass pass(gate, false);
        EXPECT_TRUE(suspectIn) << "it came after the suspect";
        lateIn = true;
    });
    std::this_thread::sleep_for(20ms);
    EXPECT_FALSE(lateIn);
    first.reset();
    suspect.join();
    late.join();
    EXPECT_TRUE(lateIn);
}

}  // namespace
}  // namespace shapedb::ingest
