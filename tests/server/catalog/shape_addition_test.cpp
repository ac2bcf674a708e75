// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/shape_addition.h"

#include <cstring>
#include <memory>

#include <gtest/gtest.h>

#include "server/catalog/limits.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;

class ShapeAdditionTest : public ::testing::Test {
  protected:
    ShapeAdditionTest() {
        auto store = std::make_unique<MemoryStore>();
        store->fault = [this](const std::string& function) -> std::optional<Error> {
            if (noJobs && function == "claimJob") return Error{ErrorCode::kStorage, "broken"};
            return std::nullopt;
        };
        CatalogOptions options;
        options.maxQueuedJobs = 1;
        catalog = std::make_unique<Catalog>(std::move(store), quickDescribe,
                                            std::make_shared<RecordingLogger>(), options);
        EXPECT_TRUE(catalog->start());
    }
    ~ShapeAdditionTest() override { EXPECT_TRUE(catalog->stop()); }

    /// One upload of `tag`, as a transport makes it.
    Result<AddedShape> add(CallFrame& frame, const std::string& key, float tag, bool wait) {
        const std::vector<float> points = taggedPoints(tag);
        const std::string bytes(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(float));
        ShapeAddition addition(*catalog, frame, 1'000, admission.uploads);
        EXPECT_TRUE(addition.upload().begin(points.size() / 3, ""));
        ShapeHeader header;
        header.key = key;
        if (const auto begun = addition.begin(header, wait); !begun) return fail(begun.error());
        EXPECT_TRUE(addition.upload().add(bytes));
        auto added = addition.finish(addition.upload().finish().value());
        Budget::Share all(admission.uploads);
        if (added) {
            EXPECT_TRUE(all.take(1'000)) << "the upload's memory has been given up";
        }
        return added;
    }

    std::atomic<bool> noJobs{false};
    std::unique_ptr<Catalog> catalog;
    Admission admission{1'000, 8};
    RunContext run;
};

TEST_F(ShapeAdditionTest, WaitsForTheShapeOnlyIfAsked) {
    CallFrame frame(*catalog, admission, run);
    const auto waited = add(frame, "cup", 5.0f, true);
    ASSERT_TRUE(waited) << waited.error().message;
    EXPECT_EQ(waited->outcome, store::PutOutcome::kCreated);
    EXPECT_EQ(waited->shape.state, store::ShapeState::kReady);
    noJobs = true;
    const auto queued = add(frame, "jug", 6.0f, false);
    ASSERT_TRUE(queued) << queued.error().message;
    EXPECT_EQ(queued->shape.state, store::ShapeState::kPending);
}

TEST_F(ShapeAdditionTest, AFullQueueSaysWhenToTryAgain) {
    noJobs = true;
    CallFrame frame(*catalog, admission, run);
    ASSERT_TRUE(add(frame, "cup", 5.0f, false));
    const auto refused = add(frame, "jug", 6.0f, false);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kQueueFull);
    EXPECT_FALSE(frame.settle(fail(refused.error()), std::nullopt));
    EXPECT_EQ(frame.retryHint(), catalog->retryAfterQueueFull());
}

TEST_F(ShapeAdditionTest, AHopelessUploadIsRefusedBeforeItsPoints) {
    CallFrame frame(*catalog, admission, run);
    const auto refused = add(frame, "", 5.0f, true);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace shapedb::catalog
