// SPDX-License-Identifier: GPL-3.0-or-later
// Listings in every order, page by page, against a plain sort of all shapes.
#include <algorithm>
#include <atomic>
#include <tuple>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

class ListingTest : public EachStoreTest {
  protected:
    /// What a listing must give, from all rows.
    std::vector<std::string> plainly(ShapeOrder order, bool descending, const ShapeFilter& filter) {
        std::vector<Shape> all = store_->listShapes(collection_.id, 0, 1000, {}).value();
        std::sort(all.begin(), all.end(), [&](const Shape& a, const Shape& b) {
            if (order == ShapeOrder::kId) return a.id < b.id;
            if (order == ShapeOrder::kKey) return a.key < b.key;
            return std::tie(a.updatedAt, a.id) < std::tie(b.updatedAt, b.id);
        });
        if (descending) std::reverse(all.begin(), all.end());
        std::vector<std::string> keys;
        for (const Shape& shape : all) {
            if (shape.key.compare(0, filter.keyPrefix.size(), filter.keyPrefix) != 0) continue;
            if (filter.state && shape.state != *filter.state) continue;
            if (filter.accept && !filter.accept(shape)) continue;
            keys.push_back(shape.key);
        }
        return keys;
    }

    std::vector<std::string> inPages(ShapeOrder order, bool descending, std::size_t limit,
                                     const ShapeFilter& filter) {
        std::vector<std::string> keys;
        ShapeListing listing{order, descending, std::nullopt};
        for (;;) {
            const auto page = store_->listShapes(collection_.id, listing, limit, filter).value();
            for (const Shape& shape : page) keys.push_back(shape.key);
            if (page.size() < limit) return keys;
            const Shape& last = page.back();
            listing.after = ShapeListing::Place{last.id, last.updatedAt, last.key};
        }
    }

    Collection collection_;
};

TEST_P(ListingTest, EveryOrderIsThatOfAPlainSort) {
    collection_ = collection();
    const Collection other = collection("other");
    const std::vector<std::string> keys = {"b",     "a/2", "a/10",     "a/1",        "a",
                                           "a0",    "B",   "\xc3\xa4", "\xc3\xa4/1", "\xf4\x8f\xbf\xbf",
                                           "a\x7f", "a/",  "c/1"};
    for (std::size_t i = 0; i < keys.size(); ++i) {
        *clock_ = 1000 + static_cast<TimestampMs>(i % 3) * 10;  // equal times among them
        put(collection_.id, keys[i], i, {{"parity", i % 2 == 0 ? "even" : "odd"}});
        put(other.id, keys[i], i);
    }
    for (int i = 0; i < 3; ++i) {
        const Job job = claim();
        if (job.collectionId == collection_.id) {
            ASSERT_TRUE(store_->finishJob(job, signatureFor(job)));
        }
    }
    ShapeFilter even;
    even.accept = [](const Shape& shape) { return shape.metadata.at("parity") == "even"; };
    ShapeFilter pending;
    pending.state = ShapeState::kPending;
    std::vector<ShapeFilter> filters = {{}, even, pending};
    for (const std::string prefix : {"a", "a/", "\xc3", "\xc3\xa4", "\xf4\x8f\xbf\xbf", "zz", "B"}) {
        ShapeFilter filter = even;
        filter.keyPrefix = prefix;
        filters.push_back(filter);
        filter.accept = nullptr;
        filters.push_back(filter);
    }
    for (const ShapeFilter& filter : filters) {
        for (const ShapeOrder order : {ShapeOrder::kId, ShapeOrder::kKey, ShapeOrder::kUpdated}) {
            for (const bool descending : {false, true}) {
                const auto expected = plainly(order, descending, filter);
                for (const std::size_t limit : {1u, 2u, 5u, 100u}) {
                    EXPECT_EQ(inPages(order, descending, limit, filter), expected)
                        << "order " << static_cast<int>(order) << " descending " << descending << " prefix '"
                        << filter.keyPrefix << "' limit " << limit;
                }
                EXPECT_EQ(store_->countShapes(collection_.id, filter).value(), expected.size());
            }
        }
    }
}

TEST_P(ListingTest, APageContinuesAfterAShapeThatIsGone) {
    collection_ = collection();
    for (const char* key : {"a", "b", "c", "d"}) put(collection_.id, key, 1);
    const auto first = store_->listShapes(collection_.id, {ShapeOrder::kKey}, 2, {}).value();
    const Shape last = first.back();
    ASSERT_TRUE(store_->deleteShape(collection_.id, "b", {}));
    put(collection_.id, "aa", 1);
    const ShapeListing next{ShapeOrder::kKey, false, ShapeListing::Place{last.id, 0, last.key}};
    const auto rest = store_->listShapes(collection_.id, next, 10, {}).value();
    ASSERT_EQ(rest.size(), 2u);
    EXPECT_EQ(rest[0].key, "c");
}

TEST_P(ListingTest, AChangeMovesAShapeToTheEndOfTheOrderOfChange) {
    collection_ = collection();
    for (const char* key : {"a", "b", "c"}) put(collection_.id, key, 1);
    const Shape a = store_->getShape(collection_.id, "a").value();
    const auto changed = store_->changeMetadata({a.id}, [](const Shape&) {
        return Metadata{{"label", "cup"}};
    });
    ASSERT_TRUE(changed);
    EXPECT_EQ(changed->front().version, 2);
    EXPECT_EQ(changed->front().pointsVersion, 1);
    const auto newest =
        store_->listShapes(collection_.id, {ShapeOrder::kUpdated, true, std::nullopt}, 1, {}).value();
    EXPECT_EQ(newest.front().key, "a");
    EXPECT_TRUE(store_->changeMetadata({a.id}, [](const Shape& shape) { return shape.metadata; })->empty())
        << "nothing changes";
    EXPECT_EQ(store_->getShape(collection_.id, "a")->version, 2);
}

TEST_P(ListingTest, ListsInOrderStopWhenTheCallerHasGone) {
    collection_ = collection();
    put(collection_.id, "a", 1);
    std::atomic<bool> cancel{true};
    ShapeFilter filter;
    filter.context.cancel = &cancel;
    for (const ShapeOrder order : {ShapeOrder::kKey, ShapeOrder::kUpdated}) {
        EXPECT_FAILS(store_->listShapes(collection_.id, {order, true, std::nullopt}, 10, filter),
                     ErrorCode::kCancelled);
    }
    filter.keyPrefix = "a";
    EXPECT_FAILS(store_->countShapes(collection_.id, filter), ErrorCode::kCancelled);
}

TEST_P(ListingTest, AliasesStandForOneCollection) {
    const Collection parts = collection();
    const Collection other = collection("other");
    ASSERT_TRUE(store_->setAlias("live", parts.id));
    ASSERT_TRUE(store_->setAlias("live", other.id));
    ASSERT_TRUE(store_->setAlias("best", parts.id));
    const auto aliases = store_->listAliases().value();
    ASSERT_EQ(aliases.size(), 2u);
    EXPECT_EQ(aliases[1].name, "live");
    EXPECT_EQ(aliases[1].collectionId, other.id);
    EXPECT_FAILS(store_->setAlias("parts", other.id), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->setAlias("x", 77), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->createCollection("live", "", ""), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->renameCollection(parts.id, "live"), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->renameCollection(parts.id, "other"), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->renameCollection(77, "new"), ErrorCode::kNotFound);
    EXPECT_EQ(store_->renameCollection(parts.id, "pieces")->name, "pieces");
    EXPECT_EQ(store_->renameCollection(parts.id, "pieces")->id, parts.id) << "a repeated request";
    EXPECT_FAILS(store_->getCollection("parts"), ErrorCode::kNotFound);
    EXPECT_FAILS(store_->deleteAlias("none"), ErrorCode::kNotFound);
    ASSERT_TRUE(store_->deleteAlias("live"));
    ASSERT_TRUE(store_->deleteCollection(parts.id));
    EXPECT_TRUE(store_->listAliases()->empty()) << "gone with their collection";
    expectSound();
}

SHAPEDB_ON_EACH_ENGINE(ListingTest);

}  // namespace
}  // namespace shapedb::store
