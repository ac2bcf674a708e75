// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/searches.h"

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/signature/signature_codec.h"
#include "server/catalog/listing.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;

constexpr float kNeverDone = 1'000.0f;

// A tag of kNeverDone or more is segmented until it is cancelled.
Result<Description> describeOrWait(const PointCloud& points, const ShapeParameters& parameters,
                                   const RunContext& context) {
    while (points.at(0).x >= kNeverDone) {
        RETURN_IF_ERROR(context.checkpoint());
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return quickDescribe(points, parameters, context);
}

class SearchesTest : public ::testing::Test {
  protected:
    SearchesTest() {
        CatalogOptions options;
        options.maxQueuedJobs = 100;
        catalog = std::make_unique<Catalog>(std::make_unique<MemoryStore>(), describeOrWait,
                                            std::make_shared<RecordingLogger>(), options);
        EXPECT_TRUE(catalog->start());
    }
    ~SearchesTest() override { EXPECT_TRUE(catalog->stop()); }

    store::Shape putOnly(const std::string& key, float tag, const std::string& collection = "") {
        ShapeHeader header;
        header.collection = collection;
        header.key = key;
        return catalog->put(header, store::VerifiedScan::verify(taggedPoints(tag)).value()).value().shape;
    }
    store::Shape putAndWait(const std::string& key, float tag, const std::string& collection = "") {
        return catalog->awaitIngest(putOnly(key, tag, collection), [] { return Result<void>(); }).value();
    }
    Searches searches() { return {*catalog, runner, 50}; }
    Result<PreparedSearch> prepare(const SearchRequest& request) {
        return searches().prepare(catalog->collection("").value(), request);
    }

    SearchRunner runner{1};
    std::unique_ptr<Catalog> catalog;
};

TEST_F(SearchesTest, RefusesOptionsOutOfRange) {
    SearchRequest request;
    EXPECT_EQ(prepare(request).error().code, ErrorCode::kInvalidArgument) << "k is 0";
    request.k = 51;
    EXPECT_EQ(prepare(request).error().code, ErrorCode::kInvalidArgument) << "k is above the limit";
    request.k = 50;
    request.threshold = 1.5;
    EXPECT_EQ(prepare(request).error().code, ErrorCode::kInvalidArgument);
    request.threshold = 0.5;
    request.filter = "=";
    EXPECT_EQ(prepare(request).error().code, ErrorCode::kMalformedFilter);
    request.filter = "label=cup";
    auto prepared = prepare(request);
    ASSERT_TRUE(prepared);
    EXPECT_EQ(prepared->options.k, 50u);
    EXPECT_EQ(prepared->options.threshold, 0.5);
}

TEST_F(SearchesTest, AStoredShapeFindsOthersButNotItself) {
    const store::Shape cup = putAndWait("cup", 5.0f);
    const store::Shape jug = putAndWait("jug", 6.0f);
    SearchRequest request;
    request.k = 10;
    auto prepared = prepare(request);
    ASSERT_TRUE(prepared);
    EXPECT_EQ(searches().storedQuery(*prepared, "none").error().code, ErrorCode::kNotFound);
    const auto query = searches().storedQuery(*prepared, "cup");
    ASSERT_TRUE(query);
    EXPECT_EQ(query->excludeId, cup.id);
    const auto found = searches().run(*prepared, *query, {});
    ASSERT_TRUE(found);
    ASSERT_EQ(found->hits.size(), 1u);
    EXPECT_EQ(found->hits[0].id, jug.id);
    const auto withSelf = searches().storedQuery(*prepared, "cup", true);
    EXPECT_EQ(searches().run(*prepared, withSelf.value(), {}).value().hits.size(), 2u);
    EXPECT_EQ(searches().count(), 2u);
}

TEST_F(SearchesTest, OnlyShapesThatCouldNotBeSearchedCountAsPending) {
    SearchRequest request;
    request.k = 10;
    putAndWait("cup", 5.0f);
    putAndWait("jug", 6.0f);
    EXPECT_EQ(prepare(request)->pending, 0u);
    EXPECT_EQ(putOnly("jug", kNeverDone).state, store::ShapeState::kPending);
    EXPECT_EQ(prepare(request)->pending, 0u) << "its older points are searched";
    putOnly("mug", kNeverDone + 1.0f);
    auto prepared = prepare(request);
    ASSERT_TRUE(prepared);
    EXPECT_EQ(prepared->pending, 1u);
    const auto query = searches().storedQuery(*prepared, "cup");
    ASSERT_TRUE(query);
    EXPECT_EQ(searches().run(*prepared, *query, {}).value().hits.size(), 1u) << "the jug of before";
}

TEST_F(SearchesTest, AScanIsSegmentedAndSearched) {
    const store::Shape cup = putAndWait("cup", 5.0f);
    SearchRequest request;
    request.k = 10;
    auto prepared = prepare(request);
    const auto scan = store::VerifiedScan::verify(taggedPoints(5.0f)).value();
    const auto searched = searches().byScan(*prepared, scan, {});
    ASSERT_TRUE(searched) << searched.error().message;
    EXPECT_EQ(searched->description.signature.volume, 5.0);
    ASSERT_EQ(searched->found.hits.size(), 1u);
    EXPECT_EQ(searched->found.hits[0].id, cup.id);
    const auto open = store::VerifiedScan::verify(taggedPoints(-1.0f)).value();
    EXPECT_EQ(searches().byScan(*prepared, open, {}).error().code, ErrorCode::kNoInterior);
}

TEST_F(SearchesTest, AnswersExplainHitsAndLeaveOutDeletedShapes) {
    putAndWait("cup", 5.0f);
    putAndWait("jug", 6.0f);
    SearchRequest request;
    request.k = 10;
    auto prepared = prepare(request);
    const auto query = searches().storedQuery(*prepared, "cup");
    VerifiedResult found = searches().run(*prepared, {{query->signature, std::nullopt}, nullptr}, {}).value();
    ASSERT_EQ(found.hits.size(), 2u);
    const auto keysOf = [&](const VerifiedResult& result) {
        std::vector<std::string> keys;
        EXPECT_TRUE(searches().visitHits(*prepared, query->signature, result, [&](const FoundHit& hit) {
            EXPECT_TRUE(hit.explanation) << hit.shape.key;
            EXPECT_EQ(hit.explanation.value_or(Explanation{}).score, hit.signatureScore);
            keys.push_back(hit.shape.key);
            return Result<void>();
        }));
        return keys;
    };
    EXPECT_EQ(keysOf(found), (std::vector<std::string>{"cup", "jug"}));
    found.hits[1].signatureScore /= 2.0;  // as if the signature had been replaced after the search
    EXPECT_TRUE(searches().visitHits(*prepared, query->signature, found, [&](const FoundHit& hit) {
        EXPECT_EQ(hit.explanation.has_value(), hit.shape.key == "cup");
        return Result<void>();
    }));
    found.hits.pop_back();
    ASSERT_TRUE(catalog->deleteShape("", "cup", std::nullopt));
    EXPECT_TRUE(keysOf(found).empty());
}

TEST_F(SearchesTest, AnAnswerInGroupsNamesTheirValues) {
    const auto labelled = [&](const std::string& key, float tag, const std::string& label) {
        const store::Shape shape = putAndWait(key, tag);
        ASSERT_TRUE(catalog->changeMetadata(catalog->epoch(), {shape.id}, [&](const store::Shape&) {
            return label.empty() ? Metadata() : Metadata{{"label", label}};
        }));
    };
    labelled("cup 1", 5.0f, "cup");
    labelled("cup 2", 5.1f, "cup");
    labelled("plain", 6.0f, "");
    labelled("jug", 9.0f, "jug");
    SearchRequest request;
    request.k = 3;
    request.groupBy = "label";
    auto prepared = prepare(request);
    ASSERT_TRUE(prepared);
    const auto query = searches().storedQuery(*prepared, "cup 1", true).value();
    const auto found = searches().run(*prepared, query, {}).value();
    std::vector<std::pair<std::string, std::string>> hits;
    ASSERT_TRUE(searches().visitHits(*prepared, query.signature, found, [&](const FoundHit& hit) {
        hits.push_back({hit.shape.key, hit.group.value_or("(none)")});
        return Result<void>();
    }));
    const std::vector<std::pair<std::string, std::string>> expected = {
        {"cup 1", "cup"}, {"plain", "(none)"}, {"jug", "jug"}};
    EXPECT_EQ(hits, expected);
    request.perGroup = 20;
    EXPECT_EQ(prepare(request).error().code, ErrorCode::kInvalidArgument) << "60 hits, the server gives 50";
}

TEST_F(SearchesTest, AQueryIsAStoredShapeOrASignature) {
    const store::Shape cup = putAndWait("cup", 5.0f);
    SearchRequest request;
    request.k = 10;
    auto prepared = prepare(request);
    const std::string key = "cup";
    const std::string bytes = encodeSignature(signatureOf(7.0));
    const std::string damaged = "damaged";
    EXPECT_EQ(searches().query(*prepared, {&key, nullptr}).value().excludeId, cup.id);
    const auto given = searches().query(*prepared, {nullptr, &bytes});
    ASSERT_TRUE(given);
    EXPECT_EQ(given->signature.volume, 7.0);
    EXPECT_FALSE(given->excludeId);
    EXPECT_FALSE(searches().query(*prepared, {nullptr, &damaged}));
    const auto none = searches().query(*prepared, {});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(none.error().message, "neither key nor signature is set");
    EXPECT_EQ(searches().query(*prepared, {&key, &bytes}).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(SearchesTest, ABatchSaysWhichOfItsQueriesIsWrong) {
    const store::Shape cup = putAndWait("cup", 5.0f);
    SearchRequest request;
    request.k = 10;
    auto prepared = prepare(request);
    const std::string key = "cup";
    const std::string none = "none";
    const std::string bytes = encodeSignature(signatureOf(7.0));
    const auto both = searches().queries(*prepared, {{&key, nullptr}, {nullptr, &bytes}});
    ASSERT_TRUE(both);
    ASSERT_EQ(both->size(), 2u);
    EXPECT_EQ(both->front().excludeId, cup.id);
    EXPECT_EQ(both->back().signature.volume, 7.0);
    const auto wrong = searches().queries(*prepared, {{&key, nullptr}, {&none, nullptr}});
    ASSERT_FALSE(wrong);
    EXPECT_EQ(wrong.error().code, ErrorCode::kNotFound);
    EXPECT_EQ(wrong.error().message.rfind("query 1: ", 0), 0u) << wrong.error().message;
}

TEST_F(SearchesTest, AComparisonExplainsAndSaysWhichShapeIsMissing) {
    putAndWait("cup", 5.0f);
    putAndWait("jug", 6.0f);
    const auto compared = searches().compare({"", "cup"}, {"default", "jug"}, {}, false, {});
    ASSERT_TRUE(compared);
    EXPECT_EQ(compared->query.volume, 5.0);
    EXPECT_EQ(compared->other.volume, 6.0);
    EXPECT_EQ(compared->verified.explanation.score,
              shapedb::explain(signatureOf(5.0), signatureOf(6.0), {}).score);
    const auto first = searches().compare({"", "none"}, {"", "none"}, {}, false, {});
    ASSERT_FALSE(first);
    EXPECT_EQ(first.error().code, ErrorCode::kNotFound);
    EXPECT_EQ(first.error().message, "query: there is no shape 'none' in collection 'default'");
    const auto second = searches().compare({"", "cup"}, {"", "none"}, {}, false, {});
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().message, "other: there is no shape 'none' in collection 'default'");
}

TEST_F(SearchesTest, AComparisonRefusesToKeepSizesInDifferentUnits) {
    for (const LengthUnit unit : {LengthUnit::kMillimetre, LengthUnit::kMetre}) {
        ShapeParameters parameters = parametersOf(Profile::kDefault);
        parameters.unit = unit;
        ASSERT_TRUE(catalog->createCollection(lengthUnitName(unit), "", parameters));
        putAndWait("cup", 5.0f, lengthUnitName(unit));
    }
    ScoreOptions kept;
    kept.keepScale = true;
    const auto refused = searches().compare({"mm", "cup"}, {"m", "cup"}, kept, false, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(refused.error().message, "keep_scale: the shapes have different units of length, mm and m");
    EXPECT_TRUE(searches().compare({"mm", "cup"}, {"m", "cup"}, {}, false, {}));
    EXPECT_TRUE(searches().compare({"mm", "cup"}, {"mm", "cup"}, kept, false, {}));
    EXPECT_EQ(searches().compare({"mm", "cup"}, {"mm", "cup"}, kept, true, {}).error().code,
              ErrorCode::kInvalidArgument)
        << "keep_scale and free_scale";
}

TEST(AnswerRoom, RefusesWhatDoesNotFit) {
    Budget all(2 * kMaxAnswerBytes, "bytes");
    AnswerRoom room(all);
    EXPECT_TRUE(room.take(kMaxAnswerBytes - 1));
    EXPECT_TRUE(room.take(1));
    EXPECT_EQ(room.take(1).error().code, ErrorCode::kInvalidArgument);
}

TEST(AnswerRoom, IsSharedByAllAnswersUntilTheyAreGone) {
    Budget all(100, "bytes");
    AnswerRoom first(all);
    {
        AnswerRoom second(all);
        EXPECT_TRUE(first.take(60));
        EXPECT_EQ(second.take(41).error().code, ErrorCode::kQueueFull);
        EXPECT_TRUE(second.take(40));
        EXPECT_EQ(first.take(1).error().code, ErrorCode::kQueueFull);
    }
    EXPECT_TRUE(first.take(40));
}

TEST_F(SearchesTest, ABatchFindsWhatEachQueryFindsAlone) {
    std::vector<std::string> keys;
    for (int i = 0; i < 40; ++i) {
        keys.push_back("shape " + std::to_string(i));
        putAndWait(keys.back(), static_cast<float>(1 + i % 7));
    }
    SearchRequest request;
    request.k = 5;
    auto prepared = searches().prepare(catalog->collection("").value(), request);
    ASSERT_TRUE(prepared);
    std::vector<QuerySource> sources;
    for (const std::string& key : keys) sources.push_back({&key, nullptr});
    const auto queries = searches().queries(*prepared, sources);
    ASSERT_TRUE(queries);
    std::vector<std::vector<std::int64_t>> found(keys.size());
    ASSERT_TRUE(searches().runBatch(*prepared, sources, {},
                                    [&](std::size_t i, const Signature&, const VerifiedResult& result) {
                                        for (const auto& hit : result.hits) found[i].push_back(hit.id);
                                        return Result<void>();
                                    }));
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const auto alone = searches().run(*prepared, (*queries)[i], {});
        ASSERT_TRUE(alone);
        std::vector<std::int64_t> expected;
        for (const auto& hit : alone->hits) expected.push_back(hit.id);
        EXPECT_EQ(found[i], expected) << keys[i];
    }
}

TEST_F(SearchesTest, PagesOfAListingFollowOneAnother) {
    for (int i = 0; i < 5; ++i) putAndWait("shape " + std::to_string(i), static_cast<float>(i + 1));
    const auto collection = catalog->collection("").value();
    ListRequest request;
    request.pageSize = 2;
    std::vector<std::string> keys;
    int pages = 0;
    do {
        const auto next = listPage(*catalog, *collection, request, {},
                                   [&](const store::Shape& shape, std::optional<double>) {
                                       keys.push_back(shape.key);
                                       return std::size_t{1};
                                   });
        ASSERT_TRUE(next);
        request.cursor = *next;
        ++pages;
    } while (!request.cursor.empty());
    EXPECT_EQ(pages, 3);
    EXPECT_EQ(keys, (std::vector<std::string>{"shape 0", "shape 1", "shape 2", "shape 3", "shape 4"}));
    EXPECT_EQ(countSelected(*catalog, *collection, {}, {}).value(), 5u);
    EXPECT_EQ(countSelected(*catalog, *collection, {"", store::ShapeState::kFailed}, {}).value(), 0u);
    request.pageSize = 0;
    request.cursor = "nonsense";
    EXPECT_EQ(listPage(*catalog, *collection, request, {}, [](const auto&, auto) { return 0; }).error().code,
              ErrorCode::kMalformedCursor);
}

TEST_F(SearchesTest, ACancelledListingEndsWithoutAPage) {
    putAndWait("cup", 5.0f);
    const std::atomic<bool> cancel{true};
    RunContext cancelled;
    cancelled.cancel = &cancel;
    const auto collection = catalog->collection("").value();
    const auto next = listPage(*catalog, *collection, {}, cancelled, [](const auto&, auto) { return 0; });
    ASSERT_FALSE(next);
    EXPECT_EQ(next.error().code, ErrorCode::kCancelled);
    const auto count = countSelected(*catalog, *collection, {"label=cup", std::nullopt}, cancelled);
    ASSERT_FALSE(count);
    EXPECT_EQ(count.error().code, ErrorCode::kCancelled);
}

TEST_F(SearchesTest, APageEndsBeforeItGrowsTooLarge) {
    for (int i = 0; i < 3; ++i) putAndWait("shape " + std::to_string(i), static_cast<float>(i + 1));
    int shapes = 0;
    const auto next = listPage(*catalog, *catalog->collection("").value(), {}, {},
                               [&](const store::Shape&, std::optional<double>) {
                                   ++shapes;
                                   return kMaxPageBytes;
                               });
    ASSERT_TRUE(next);
    EXPECT_EQ(shapes, 1);
    EXPECT_FALSE(next->empty());
}

}  // namespace
}  // namespace shapedb::catalog
