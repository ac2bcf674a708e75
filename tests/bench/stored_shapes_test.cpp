// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/stored_shapes.h"

#include <atomic>

#include "tests/server/store/store_fixture.h"

namespace shapedb::bench {

using namespace store;

namespace {

FillShape made(std::uint64_t i) {
    return {"shape-" + std::to_string(i), {{"family", "mug"}}, "signature " + std::to_string(i)};
}

SqliteOptions optionsIn(const Folder& folder) {
    SqliteOptions options;
    options.path = folder.file("shapes.db");
    return options;
}

TEST(BulkFill, MakesAValidDatabase) {
    const Folder folder;
    const auto options = optionsIn(folder);
    ASSERT_TRUE(fillDatabase(options, "default", "parameters", 25, made));
    const auto store = openSqliteStore(options);
    ASSERT_TRUE(store) << store.error().message;
    const auto collection = (*store)->getCollection("default");
    ASSERT_TRUE(collection);
    EXPECT_EQ(collection->parameters, "parameters");
    const auto rows = (*store)->loadIndex(collection->id, 0, 100);
    ASSERT_TRUE(rows);
    ASSERT_EQ(rows->size(), 25U);
    const auto last = (*store)->getShapeById(rows->back().shapeId);
    ASSERT_TRUE(last);
    EXPECT_EQ(last->key, "shape-24");
    EXPECT_EQ(last->state, ShapeState::kReady);
    EXPECT_EQ(rows->back().metadata, (Metadata{{"family", "mug"}}));
    EXPECT_EQ(rows->back().signature.bytes, "signature 24");
    EXPECT_EQ((*store)->queueDepth()->jobs, 0U);
    const auto problems = (*store)->check({});
    ASSERT_TRUE(problems);
    EXPECT_TRUE(problems->empty()) << problems->front();
}

TEST(BulkFill, RefusesATakenCollection) {
    const Folder folder;
    const auto options = optionsIn(folder);
    ASSERT_TRUE(fillDatabase(options, "default", "", 1, made));
    EXPECT_EQ(fillDatabase(options, "default", "", 1, made).error().code, ErrorCode::kAlreadyExists);
}

TEST(BulkFill, CanBeStopped) {
    const Folder folder;
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(fillDatabase(optionsIn(folder), "default", "", 1, made, context).error().code,
              ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb::bench
