// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/call_frame.h"

#include <memory>
#include <new>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "server/catalog/limits.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;
using namespace std::chrono_literals;

class CallFrameTest : public ::testing::Test {
  protected:
    CallFrameTest() : catalog(std::make_unique<MemoryStore>(), quickDescribe, log, {}) {
        EXPECT_TRUE(catalog.start());
        EXPECT_TRUE(catalog.backup("backup", {}));
    }
    ~CallFrameTest() override { EXPECT_TRUE(catalog.stop()); }

    static Result<void> failed(ErrorCode code) { return fail(code, "why"); }

    std::shared_ptr<RecordingLogger> log = std::make_shared<RecordingLogger>();
    Catalog catalog;
    Admission admission{1'000, 8};
    RunContext run;
};

TEST_F(CallFrameTest, KeepsResultsThatNothingContradicts) {
    CallFrame frame(catalog, admission, run);
    ASSERT_TRUE(frame.admit(security::CallClass::kOrdinary));
    EXPECT_TRUE(frame.settle({}, std::nullopt));
    EXPECT_FALSE(frame.retryHint());

    const auto missing = frame.settle(failed(ErrorCode::kNotFound), std::nullopt);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
    EXPECT_EQ(missing.error().message, "why");
    EXPECT_FALSE(frame.retryHint());
}

TEST_F(CallFrameTest, ACallFromBeforeARestoreIsToBeRepeated) {
    CallFrame reading(catalog, admission, run);
    CallFrame restoring(catalog, admission, run);
    restoring.expectRestore();
    ASSERT_TRUE(catalog.restore("backup", {}));

    EXPECT_TRUE(restoring.settle({}, std::nullopt)) << "the call that restored succeeds";
    const auto read = reading.settle({}, std::nullopt);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kUnavailable);
    EXPECT_EQ(reading.retryHint(), kRestoreRetry);

    CallFrame later(catalog, admission, run);
    EXPECT_TRUE(later.settle({}, std::nullopt));
}

TEST_F(CallFrameTest, ADrainingServerAdmitsNobodyAndGivesNoHint) {
    CallFrame running(catalog, admission, run);
    ASSERT_TRUE(running.admit(security::CallClass::kOrdinary));
    ASSERT_TRUE(running.checkpointWhileFollowing());
    admission.calls.drain();
    EXPECT_EQ(running.checkpointWhileFollowing().error().code, ErrorCode::kUnavailable);

    CallFrame late(catalog, admission, run);
    auto refused = late.admit(security::CallClass::kOrdinary);
    EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
    refused = late.settle(std::move(refused), std::nullopt);
    EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
    EXPECT_FALSE(late.retryHint()) << "nobody knows when the server is back";
}

TEST_F(CallFrameTest, LeavesTheGateOnlyIfAdmitted) {
    {
        CallFrame frame(catalog, admission, run);
        ASSERT_TRUE(frame.admit(security::CallClass::kOrdinary));
        EXPECT_FALSE(admission.calls.waitUntilEmpty(std::chrono::steady_clock::now()));
        CallFrame other(catalog, admission, run);
    }
    EXPECT_TRUE(admission.calls.waitUntilEmpty(std::chrono::steady_clock::now()));
}

TEST_F(CallFrameTest, ACancellationByTheDeadlineIsCalledThat) {
    run.deadline = RunContext::Clock::now() - 1ms;
    CallFrame late(catalog, admission, run);
    EXPECT_EQ(late.settle(failed(ErrorCode::kCancelled), std::nullopt).error().code,
              ErrorCode::kDeadlineExceeded);
    EXPECT_EQ(late.settle(failed(ErrorCode::kNotFound), std::nullopt).error().code, ErrorCode::kNotFound);
    run.deadline = RunContext::Clock::time_point::max();
    EXPECT_EQ(late.settle(failed(ErrorCode::kCancelled), std::nullopt).error().code, ErrorCode::kCancelled);
}

TEST_F(CallFrameTest, ACutOffCallTellsWhyUnlessItSucceeded) {
    run.deadline = RunContext::Clock::now() - 1ms;
    CallFrame frame(catalog, admission, run);
    const Error stalled{ErrorCode::kCancelled, "stalled"};
    EXPECT_TRUE(frame.settle({}, stalled));
    const auto cut = frame.settle(failed(ErrorCode::kQueueFull), stalled);
    ASSERT_FALSE(cut);
    EXPECT_EQ(cut.error().code, ErrorCode::kCancelled);
    EXPECT_EQ(cut.error().message, "stalled");
    EXPECT_FALSE(frame.retryHint());
}

TEST_F(CallFrameTest, AFullQueueSaysWhenToTryAgain) {
    CallFrame frame(catalog, admission, run);
    EXPECT_FALSE(frame.settle(failed(ErrorCode::kQueueFull), std::nullopt));
    EXPECT_EQ(frame.retryHint(), kBudgetRetry);
    CallFrame informed(catalog, admission, run);
    informed.retryAfter(7s);
    EXPECT_FALSE(informed.settle(failed(ErrorCode::kQueueFull), std::nullopt));
    EXPECT_EQ(informed.retryHint(), 7s);
}

TEST(Guarded, ExceptionsBecomeErrorsThatTheCallerUnderstands) {
    EXPECT_TRUE(guarded([] { return Result<void>(); }));
    const auto memory = guarded([]() -> Result<void> { throw std::bad_alloc(); });
    EXPECT_EQ(memory.error().code, ErrorCode::kOutOfMemory);
    const auto known = guarded([]() -> Result<void> { throw std::runtime_error("broken"); });
    EXPECT_EQ(known.error().code, ErrorCode::kInternal);
    EXPECT_EQ(known.error().message, "unexpected failure: broken");
    const auto unknown = guarded([]() -> Result<void> { throw 1; });
    EXPECT_EQ(unknown.error().code, ErrorCode::kInternal);
}

TEST_F(CallFrameTest, FollowersGiveTheirPlacesBack) {
    {
        std::vector<std::unique_ptr<CallFrame>> followers;
        for (int i = 0; i < kMaxFollowers; ++i) {
            followers.push_back(std::make_unique<CallFrame>(catalog, admission, run));
            ASSERT_TRUE(followers.back()->becomeFollower());
        }
        CallFrame late(catalog, admission, run);
        EXPECT_EQ(late.becomeFollower().error().code, ErrorCode::kQueueFull);
    }
    CallFrame next(catalog, admission, run);
    EXPECT_TRUE(next.becomeFollower());
}

}  // namespace
}  // namespace shapedb::catalog
