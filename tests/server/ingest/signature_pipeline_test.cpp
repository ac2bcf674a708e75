// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/ingest/signature_pipeline.h"

#include <atomic>
#include <new>

#include <gtest/gtest.h>

#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::ingest {
namespace {

using namespace shapedb::testing;
using namespace std::chrono_literals;

class Pipeline : public ::testing::Test {
  protected:
    Pipeline() {
        const auto parts = *store.createCollection("parts", "", paperParameters());
        shape = store.putShape(putRequest(parts.id, "k", taggedPoints(1.0f)))->shape;
    }

    /// Runs out of memory so many times first.
    PipelineOutcome runWith(int failures, RunContext context = {}) {
        SignaturePipeline pipeline = [&](const PointCloud& points, const ShapeParameters& parameters,
                                         const RunContext& run) -> Result<Description> {
            ++tries;
            if (tries <= failures && tries % 2 == 0) throw std::bad_alloc();
            if (tries <= failures) return fail(ErrorCode::kOutOfMemory, "none left");
            return quickDescribe(points, parameters, run);
        };
        pipeline.pauseWithoutMemory({1ms, 1ms, 1ms});
        return pipeline.run(store, shape.id, parametersOf(Profile::kPaper), context);
    }

    MemoryStore store;
    store::Shape shape;
    int tries = 0;
};

TEST_F(Pipeline, APassingShortageOfMemoryFailsNoScan) {
    EXPECT_EQ(runWith(3).kind, PipelineOutcome::Kind::kSignature);
    EXPECT_EQ(tries, 4);
}

TEST_F(Pipeline, AScanForWhichThereIsNeverMemoryFails) {
    const auto outcome = runWith(100);
    EXPECT_EQ(outcome.kind, PipelineOutcome::Kind::kScanFailed);
    EXPECT_EQ(outcome.why.code, ErrorCode::kOutOfMemory);
    EXPECT_EQ(tries, 4);
}

TEST_F(Pipeline, WaitingForMemoryCanBeCancelled) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(runWith(100, context).kind, PipelineOutcome::Kind::kCancelled);
    EXPECT_EQ(tries, 1);
}

}  // namespace
}  // namespace shapedb::ingest
