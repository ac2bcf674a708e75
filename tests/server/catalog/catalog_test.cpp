// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/catalog.h"

#include <atomic>
#include <functional>
#include <future>

#include <gtest/gtest.h>

#include "server/catalog/call_frame.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;

Result<void> goOn() { return {}; }

ParameterOverrides withMaxPoints(std::uint32_t maxPoints) {
    ParameterOverrides overrides;
    overrides.maxPoints = maxPoints;
    return overrides;
}

class CatalogTest : public ::testing::Test {
  protected:
    CatalogTest() {
        auto owned = std::make_unique<MemoryStore>();
        owned->fault = [this](const std::string& function) -> std::optional<Error> {
            if (function == "listCollections" && loading) return loading();
            if (noJobs && function == "claimJob") return Error{ErrorCode::kStorage, "broken"};
            return std::nullopt;
        };
        CatalogOptions options;
        options.maxQueuedJobs = 100;
        options.rebuilds.yield = std::chrono::milliseconds(1);
        catalog = std::make_unique<Catalog>(std::move(owned), quickDescribe, log, options);
        EXPECT_TRUE(catalog->start());
    }
    ~CatalogTest() override { EXPECT_TRUE(catalog->stop()); }

    Result<AddedShape> put(const std::string& key, float tag, Metadata metadata = {},
                           const std::string& collection = "") {
        ShapeHeader header;
        header.collection = collection;
        header.key = key;
        header.metadata = store::replacedBy(std::move(metadata));
        return catalog->put(header, store::VerifiedScan::verify(taggedPoints(tag)).value());
    }
    store::Shape putAndWait(const std::string& key, float tag) {
        return catalog->awaitIngest(put(key, tag).value().shape, goOn).value();
    }
    double searched(std::int64_t id) { return cachedVolume(catalog->collection("").value()->signatures, id); }

    std::shared_ptr<RecordingLogger> log = std::make_shared<RecordingLogger>();
    std::atomic<bool> noJobs{false};
    /// Called when the index begins to load, after the store has replaced its content.
    std::function<std::optional<Error>()> loading;
    std::unique_ptr<Catalog> catalog;
};

TEST_F(CatalogTest, StartCreatesTheDefaultCollection) {
    EXPECT_EQ(catalog->collection("").value()->collection.name, "default");
    EXPECT_EQ(catalog->collection("default").value()->collection.name, "default");
    EXPECT_EQ(catalog->collection("other").error().code, ErrorCode::kNotFound);
}

TEST_F(CatalogTest, AShapeIsSearchedOnceItIsReady) {
    const store::Shape shape = putAndWait("cup", 5.0f);
    EXPECT_EQ(shape.state, store::ShapeState::kReady);
    EXPECT_EQ(searched(shape.id), 5.0);
    auto found = catalog->findShape(catalog->collection("").value(), "cup");
    ASSERT_TRUE(found);
    EXPECT_EQ(catalog->signature(*found).value().volume, 5.0);
}

TEST_F(CatalogTest, NewMetadataIsSearchedAtOnce) {
    const store::Shape shape = putAndWait("cup", 5.0f);
    const auto changed = put("cup", 5.0f, {{"label", "cup"}});
    ASSERT_TRUE(changed);
    EXPECT_EQ(changed->outcome, store::PutOutcome::kMetadataChanged);
    const auto snapshot = catalog->collection("").value();
    const auto place = snapshot->signatures.find(shape.id);
    ASSERT_TRUE(place);
    EXPECT_EQ(place.block->metadata(place.row), (Metadata{{"label", "cup"}}));
}

TEST_F(CatalogTest, ADeletedShapeIsNotSearched) {
    const store::Shape shape = putAndWait("cup", 5.0f);
    EXPECT_EQ(catalog->deleteShape("", "cup", 7).error().code, ErrorCode::kVersionConflict);
    EXPECT_EQ(searched(shape.id), 5.0);
    EXPECT_EQ(catalog->deleteShape("", "cup", 1).value().shape.id, shape.id);
    EXPECT_EQ(searched(shape.id), 0.0);
}

TEST_F(CatalogTest, RefusesAHopelessUploadBeforeItsPoints) {
    ShapeHeader header;
    header.key = "cup";
    EXPECT_TRUE(catalog->admitUpload(header));
    header.expectedVersion = -1;
    EXPECT_EQ(catalog->admitUpload(header).error().code, ErrorCode::kInvalidArgument);
    header.expectedVersion.reset();
    header.metadata.set = {{"a b", "no blanks"}};
    EXPECT_EQ(catalog->admitUpload(header).error().code, ErrorCode::kInvalidArgument);
    header.metadata.set.clear();
    header.collection = "unknown";
    EXPECT_EQ(catalog->admitUpload(header).error().code, ErrorCode::kNotFound);
    header.collection.clear();
    header.key.clear();
    EXPECT_EQ(catalog->admitUpload(header).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(CatalogTest, DeletingANonEmptyCollectionNeedsForce) {
    ASSERT_TRUE(catalog->createCollection("parts", "", parametersOf(Profile::kPaper)));
    ASSERT_TRUE(put("cup", 5.0f, {}, "parts"));
    EXPECT_EQ(catalog->deleteCollection("", true).error().code, ErrorCode::kInvalidArgument)
        << "the default collection must be named";
    EXPECT_EQ(catalog->deleteCollection("parts", false).error().code, ErrorCode::kRejected);
    EXPECT_TRUE(catalog->deleteCollection("parts", true));
    EXPECT_EQ(catalog->collection("parts").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(put("cup", 5.0f, {}, "parts").error().code, ErrorCode::kNotFound);
}

TEST_F(CatalogTest, RestoreBringsBackTheOldContentAndRaisesTheEpoch) {
    const store::Shape before = putAndWait("before", 5.0f);
    ASSERT_TRUE(catalog->backup("backup", {}));
    const store::Shape after = putAndWait("after", 6.0f);
    const auto epoch = catalog->epoch();
    EXPECT_FALSE(catalog->restore("unknown", {}));
    EXPECT_EQ(catalog->epoch(), epoch) << "nothing was replaced";
    ASSERT_TRUE(catalog->restore("backup", {}));
    EXPECT_GT(catalog->epoch(), epoch);
    EXPECT_EQ(searched(before.id), 5.0);
    EXPECT_EQ(searched(after.id), 0.0);
    EXPECT_EQ(putAndWait("new", 7.0f).state, store::ShapeState::kReady) << "the workers continue";
}

TEST_F(CatalogTest, NothingIsLookedUpWhileStoreAndIndexDiffer) {
    const store::Shape cup = putAndWait("cup", 5.0f);
    ASSERT_TRUE(catalog->backup("backup", {}));
    const auto before = catalog->epoch();
    auto between = before;
    loading = [&]() -> std::optional<Error> {
        between = catalog->epoch();
        for (const std::string name : {"", "default", "unknown"}) {
            const auto found = catalog->collection(name);
            EXPECT_EQ(found ? ErrorCode::kInternal : found.error().code, ErrorCode::kUnavailable) << name;
        }
        EXPECT_FALSE(catalog->collections());
        return std::nullopt;
    };
    ASSERT_TRUE(catalog->restore("backup", {}));
    EXPECT_GT(between, before) << "calls from before must be repeated";
    EXPECT_GT(catalog->epoch(), between) << "and those that began in between";
    EXPECT_EQ(searched(cup.id), 5.0);
}

TEST_F(CatalogTest, ContentThatCannotBeLoadedIsNotMixedWithTheOld) {
    const store::Shape cup = putAndWait("cup", 5.0f);
    ASSERT_TRUE(catalog->backup("backup", {}));
    loading = [] { return Error{ErrorCode::kDataLoss, "broken parameters"}; };
    const auto restored = catalog->restore("backup", {});
    ASSERT_FALSE(restored);
    EXPECT_EQ(restored.error().code, ErrorCode::kDataLoss);
    EXPECT_NE(restored.error().message.find("has replaced the content"), std::string::npos);
    const auto expectNothing = [&] {
        EXPECT_EQ(catalog->collection("").error().code, ErrorCode::kUnavailable);
        EXPECT_EQ(put("jug", 6.0f).error().code, ErrorCode::kUnavailable);
        EXPECT_EQ(catalog->createCollection("parts", "", parametersOf(Profile::kPaper)).error().code,
                  ErrorCode::kUnavailable);
        EXPECT_EQ(catalog->deleteCollection("default", true).error().code, ErrorCode::kUnavailable);
    };
    expectNothing();
    EXPECT_FALSE(catalog->restore("unknown", {}));
    expectNothing();
    loading = nullptr;
    ASSERT_TRUE(catalog->restore("backup", {}));
    EXPECT_EQ(searched(cup.id), 5.0);
    EXPECT_TRUE(put("jug", 6.0f));
}

TEST_F(CatalogTest, ARebuildIsFollowedToItsEnd) {
    putAndWait("cup", 5.0f);
    const auto rebuilds = catalog->beginRebuilds({"default"}, withMaxPoints(3));
    ASSERT_TRUE(rebuilds) << rebuilds.error().message;
    std::uint64_t done = 0;
    ASSERT_TRUE(
        catalog->followRebuild("default", rebuilds->front(), {}, goOn, [&](const store::Rebuild& now) {
            done = now.done;
            return Result<void>();
        }));
    EXPECT_EQ(done, 1u);
    EXPECT_EQ(catalog->collection("").value()->parameters.signature.maxPoints, 3u);
    EXPECT_EQ(catalog->cancelRebuild("").error().code, ErrorCode::kNotFound);
}

TEST_F(CatalogTest, ReadsThatBeganBeforeASwitchOfGenerationsGoOnAfterIt) {
    putAndWait("cup", 5.0f);
    auto before = catalog->findShape(catalog->collection("").value(), "cup");
    ASSERT_TRUE(before);
    const auto rebuilds = catalog->beginRebuilds({"default"}, withMaxPoints(3));
    ASSERT_TRUE(catalog->followRebuild("default", rebuilds->front(), {}, goOn,
                                       [](const store::Rebuild&) { return Result<void>(); }));
    const auto signature = catalog->signature(*before);
    ASSERT_TRUE(signature) << signature.error().message;
    EXPECT_EQ(signature->scale, 3.0) << "made with the new parameters";
    EXPECT_EQ(before->collection->collection.generation, 2) << "searched in the new collection";
}

TEST_F(CatalogTest, ARebuildThatWaitedForARestoreIsOneOfTheNewContent) {
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    parameters.segmentation.maxSegments = 11;
    ASSERT_TRUE(catalog->createCollection("parts", "", parameters));
    ASSERT_TRUE(catalog->backup("backup", {}));
    ASSERT_TRUE(catalog->deleteCollection("parts", true));
    parameters.segmentation.maxSegments = 12;
    ASSERT_TRUE(catalog->createCollection("parts", "", parameters));
    std::future<Result<std::vector<store::Rebuild>>> begun;
    std::future<Result<index::SnapshotPtr>> reloaded;
    loading = [&]() -> std::optional<Error> {
        begun = std::async(std::launch::async,
                           [&] { return catalog->beginRebuilds({"parts"}, withMaxPoints(3)); });
        reloaded = std::async(std::launch::async, [&] { return catalog->reload("parts"); });
        EXPECT_TRUE(eventually([&] { return catalog->waitingWrites() == 2; }));
        return std::nullopt;
    };
    ASSERT_TRUE(catalog->restore("backup", {}));
    const auto rebuilds = begun.get();
    ASSERT_TRUE(rebuilds) << rebuilds.error().message;
    const store::Rebuild& rebuild = rebuilds->front();
    const auto now = catalog->collection("parts").value();
    EXPECT_EQ(rebuild.collectionId, now->collection.id);
    const auto used = store::decodeParameters(rebuild.parameters);
    ASSERT_TRUE(used);
    EXPECT_EQ(used->segmentation.maxSegments, 11u) << "of the backup";
    EXPECT_EQ(used->signature.maxPoints, 3u);
    const auto snapshot = reloaded.get();
    ASSERT_TRUE(snapshot) << snapshot.error().message;
    EXPECT_EQ((*snapshot)->collection.id, now->collection.id);
}

TEST_F(CatalogTest, ARebuildMeansTheNamedCollectionOrAll) {
    ASSERT_TRUE(catalog->createCollection("parts", "", parametersOf(Profile::kPaper)));
    using Names = std::vector<std::string>;
    RebuildRequest request;
    EXPECT_EQ(catalog->rebuildTargets(request).value(), (Names{"default", "parts"}));
    request.change = withMaxPoints(3);
    const auto nameless = catalog->rebuildTargets(request);
    ASSERT_FALSE(nameless);
    EXPECT_EQ(nameless.error().message, "collection: name the collection that gets the new parameters");
    request.collection = "parts";
    EXPECT_EQ(catalog->rebuildTargets(request).value(), Names{"parts"});
    request.cacheOnly = true;
    const auto cached = catalog->rebuildTargets(request);
    ASSERT_FALSE(cached);
    EXPECT_EQ(cached.error().message, "parameters cannot change with cache_only: leave one out");
    request.change.reset();
    EXPECT_EQ(catalog->rebuildTargets(request).value(), Names{"parts"});
    request.collection = "none";
    EXPECT_EQ(catalog->rebuildTargets(request).error().code, ErrorCode::kNotFound);
}

TEST_F(CatalogTest, RebuildsOfSeveralCollectionsBeginTogether) {
    ASSERT_TRUE(catalog->createCollection("parts", "", parametersOf(Profile::kPaper)));
    const auto rebuilds = catalog->beginRebuilds({"default", "parts"}, std::nullopt);
    ASSERT_TRUE(rebuilds) << rebuilds.error().message;
    ASSERT_EQ(rebuilds->size(), 2u);
    const auto parts = catalog->collection("parts").value();
    EXPECT_EQ((*rebuilds)[1].collectionId, parts->collection.id);
    EXPECT_EQ((*rebuilds)[1].parameters, store::encodeParameters(parts->parameters));
    const auto refused = catalog->beginRebuilds({"default"}, withMaxPoints(0));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(CatalogTest, ARebuildTellsOfEachCollectionToItsEnd) {
    putAndWait("cup", 5.0f);
    ASSERT_TRUE(catalog->createCollection("parts", "", parametersOf(Profile::kPaper)));
    Admission admission{1'000, 8};
    const RunContext run;
    std::vector<RebuildProgress> told;
    const auto rebuild = [&](const RebuildRequest& request) {
        told.clear();
        CallFrame frame(*catalog, admission, run);
        return catalog->rebuild(request, frame, [&](const RebuildProgress& progress) {
            EXPECT_GE(progress.seconds, 0.0);
            told.push_back(progress);
            return Result<void>();
        });
    };
    RebuildRequest request;
    ASSERT_TRUE(rebuild(request));
    std::vector<std::string> finished;
    for (const RebuildProgress& progress : told) {
        if (progress.finished) finished.push_back(progress.collection);
    }
    EXPECT_EQ(finished, (std::vector<std::string>{"default", "parts"}));

    request.cacheOnly = true;
    ASSERT_TRUE(rebuild(request));
    ASSERT_EQ(told.size(), 2u);
    EXPECT_TRUE(told[0].finished);
    EXPECT_EQ(told[0].done, 1u);
    EXPECT_EQ(told[0].total, 1u);

    request.cacheOnly = false;
    request.detached = true;
    request.collection = "default";
    ASSERT_TRUE(rebuild(request));
    ASSERT_EQ(told.size(), 1u) << "only how it begins";
    EXPECT_EQ(told[0].total, 1u);
}

TEST_F(CatalogTest, AWatcherIsNotToldTheSameTwice) {
    noJobs = true;
    const auto added = put("cup", 5.0f);
    ASSERT_TRUE(added);
    std::vector<IngestEvent> events;
    ASSERT_TRUE(catalog->watchIngest(added->shape.id, goOn, [&](const IngestEvent& event) {
        events.push_back(event);
        if (events.size() == 1) {
            noJobs = false;
            (void)put("jug", 6.0f);
        }
        return Result<void>();
    }));
    ASSERT_GE(events.size(), 2u);
    EXPECT_EQ(events.front().stage, "queued");
    EXPECT_EQ(events.back().state, store::ShapeState::kReady);
    EXPECT_EQ(events.back().stage, "");
    for (std::size_t i = 1; i < events.size(); ++i) EXPECT_FALSE(events[i] == events[i - 1]) << i;
}

TEST_F(CatalogTest, StatsTellWaitingJobsFromRunningOnes) {
    noJobs = true;
    ASSERT_TRUE(put("cup", 5.0f));
    ASSERT_TRUE(put("jug", 6.0f));
    ASSERT_TRUE(eventually([&] { return catalog->stats().value().running == 0; }));
    EXPECT_EQ(catalog->stats().value().queued, 2u);
    EXPECT_EQ(catalog->stats().value().queue.jobs, 2u);
}

TEST_F(CatalogTest, FollowingEndsWhenTheCallerGivesUp) {
    noJobs = true;
    const auto added = put("cup", 5.0f);
    ASSERT_TRUE(added);
    const auto waited = catalog->awaitIngest(
        added->shape, []() -> Result<void> { return fail(ErrorCode::kCancelled, "no longer interested"); });
    ASSERT_FALSE(waited);
    EXPECT_EQ(waited.error().code, ErrorCode::kCancelled);
    EXPECT_NE(waited.error().message.find("the scan is stored and will be segmented"), std::string::npos);
}

}  // namespace
}  // namespace shapedb::catalog
