// SPDX-License-Identifier: GPL-3.0-or-later
// Deletions of shapes, which may be repeated when their reply was lost.
#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

using DeletionTest = EachStoreTest;

TEST_P(DeletionTest, OfAShapeCanBeRepeated) {
    const Collection parts = collection();
    const Shape before = put(parts.id, "a", 1, {{"label", "cup"}, {"n", "1"}});
    const Shape deleted = store_->deleteShape(parts.id, "a", 1).value();
    EXPECT_EQ(deleted, before);
    for (int i = 0; i < 2; ++i) {
        const auto again = store_->deleteShape(parts.id, "a", 1);
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_EQ(*again, before);
        open();  // the reply may have been lost with the server
    }
    EXPECT_FAILS(store_->deleteShape(parts.id, "a", 2), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->deleteShape(parts.id, "a", std::nullopt), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->deleteShape(parts.id, "b", 1), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->deleteShape(collection("other").id, "a", 1), ErrorCode::kNotFound);
    // Another shape has the key now, and is not meant.
    const Shape next = put(parts.id, "a", 2);
    ASSERT_TRUE(store_->putShape(request(parts.id, "a", cloud(3))));
    EXPECT_FAILS(store_->deleteShape(parts.id, "a", 1), ErrorCode::kVersionConflict);
    EXPECT_TRUE(store_->getShapeById(next.id));
    expectSound();
}

TEST_P(DeletionTest, OfAFailedShapeIsRepeatedWithItsReason) {
    const Collection parts = collection();
    put(parts.id, "a", 1);
    ASSERT_TRUE(store_->failJob(claim(), {ErrorCode::kNoInterior, "no closed interior"}));
    const Shape deleted = store_->deleteShape(parts.id, "a", 1).value();
    EXPECT_EQ(store_->deleteShape(parts.id, "a", 1).value(), deleted);
    ASSERT_TRUE(deleted.failure);
}

TEST_P(DeletionTest, OnlyTheLastAreRemembered) {
    const Collection parts = collection();
    for (std::int64_t i = 0; i < kDeletionsRemembered + 20; ++i) {
        put(parts.id, std::to_string(i), 1);
        ASSERT_TRUE(store_->deleteShape(parts.id, std::to_string(i), 1));
    }
    EXPECT_FAILS(store_->deleteShape(parts.id, "19", 1), ErrorCode::kNotFound);
    EXPECT_TRUE(store_->deleteShape(parts.id, "20", 1));
    EXPECT_TRUE(store_->deleteShape(parts.id, std::to_string(kDeletionsRemembered + 19), 1));
}

SHAPEDB_ON_EACH_ENGINE(DeletionTest);

}  // namespace
}  // namespace shapedb::store
