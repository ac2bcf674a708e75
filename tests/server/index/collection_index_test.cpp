// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/index/collection_index.h"

#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::index {
namespace {

using namespace shapedb::testing;

class Index : public ::testing::Test {
  protected:
    Index() : log(std::make_shared<RecordingLogger>()), index(store, log) {
        parts = *store.createCollection("parts", "", paperParameters());
        EXPECT_TRUE(index.loadAll());
    }

    /// A stored shape with a signature of this volume.
    store::Shape put(const std::string& key, float volume, Metadata metadata = {}) {
        const auto points = taggedPoints(volume);
        const auto shape = store.putShape(putRequest(parts.id, key, points, std::move(metadata)))->shape;
        while (const auto job = *store.claimJob()) {
            const std::string bytes = encodeSignature(signatureOf(volume));
            EXPECT_TRUE(store.finishJob(*job, {job->shapeId, job->pointsVersion, generation(), bytes}));
        }
        return shape;
    }

    std::int64_t generation() { return store.getCollection("parts")->generation; }

    SnapshotPtr snapshot() { return *index.byName("parts"); }

    /// The content of the store, shape by shape.
    void expectSameAsStore() {
        const auto rows = *store.loadIndex(parts.id, 0, 1'000'000);
        const SnapshotPtr now = snapshot();
        EXPECT_EQ(now->signatures.size(), rows.size());
        for (const store::IndexRow& row : rows) {
            const auto place = now->signatures.find(row.shapeId);
            ASSERT_TRUE(place) << row.shapeId;
            EXPECT_EQ(place.block->metadata(place.row), row.metadata);
            const PackedShape stored(decodeSignature(row.signature.bytes).value());
            EXPECT_TRUE(sameShape(place.block->rows()[place.row], stored.row(), true));
        }
    }

    MemoryStore store;
    std::shared_ptr<RecordingLogger> log;
    CollectionIndex index;
    store::Collection parts;
};

TEST_F(Index, LoadsEverythingStored) {
    for (int i = 0; i < 5'000; ++i) put(std::to_string(i), static_cast<float>(i + 1));
    ASSERT_TRUE(index.loadAll());
    EXPECT_EQ(snapshot()->signatures.size(), 5'000u) << "more than one batch";
    EXPECT_EQ(index.totals().signatures, 5'000u);
    EXPECT_GT(index.totals().bytes, 5'000u * 32u);
    expectSameAsStore();
}

// More than two batches, decoded side by side: all there, in the order of their ids, none twice.
TEST_F(Index, LoadsManyBatches) {
    constexpr std::size_t kShapes = 4'500;
    for (std::size_t i = 0; i < kShapes; ++i) put("shape-" + std::to_string(i), 1.0f + static_cast<float>(i));
    ASSERT_TRUE(index.loadAll());
    EXPECT_EQ(index.totals().signatures, kShapes);
    expectSameAsStore();
    ASSERT_TRUE(index.reload(parts.id));
    EXPECT_EQ(index.totals().signatures, kShapes);
    expectSameAsStore();
}

TEST_F(Index, FindsCollectionsByNameAndById) {
    EXPECT_EQ((*index.byName("parts"))->collection.id, parts.id);
    EXPECT_EQ((*index.byId(parts.id))->collection.name, "parts");
    EXPECT_EQ(snapshot()->parameters.profile, Profile::kPaper);
    EXPECT_EQ(index.byName("nothing").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(index.byId(999).error().code, ErrorCode::kNotFound);
    const auto cups = *store.createCollection("cups", "", paperParameters());
    EXPECT_FALSE(index.byName("cups"));
    ASSERT_TRUE(index.add(cups));
    ASSERT_EQ(index.all().size(), 2u);
    EXPECT_EQ(index.all()[0]->collection.name, "cups");
    index.remove(cups.id);
    index.remove(999);
    EXPECT_FALSE(index.byName("cups"));
    EXPECT_FALSE(index.byId(cups.id));
}

// Deleted and created again before the first deletion is applied.
TEST_F(Index, RemovingKeepsANewCollectionOfTheSameName) {
    ASSERT_TRUE(store.deleteCollection(parts.id));
    const auto successor = *store.createCollection("parts", "", paperParameters());
    ASSERT_TRUE(index.add(successor));
    index.remove(parts.id);
    ASSERT_TRUE(index.byName("parts"));
    EXPECT_EQ((*index.byName("parts"))->collection.id, successor.id);
    EXPECT_EQ(index.all().size(), 1u);
}

TEST_F(Index, RefreshFollowsTheStore) {
    const auto a = put("a", 1.0f);
    EXPECT_EQ(snapshot()->signatures.size(), 0u);
    ASSERT_TRUE(index.refresh(parts.id, a.id));
    expectSameAsStore();
    EXPECT_EQ(snapshot()->signatures.size(), 1u);
    const SnapshotPtr old = snapshot();

    const auto points = taggedPoints(1.0f);
    ASSERT_TRUE(store.putShape(putRequest(parts.id, "a", points, {{"label", "new"}})));
    ASSERT_TRUE(index.refresh(parts.id, a.id));
    expectSameAsStore();
    const SnapshotPtr relabelled = snapshot();
    const auto place = relabelled->signatures.find(a.id);
    EXPECT_EQ(place.block->metadata(place.row).at("label"), "new");

    ASSERT_TRUE(store.deleteShape(parts.id, "a", std::nullopt));
    ASSERT_TRUE(index.refresh(parts.id, a.id));
    EXPECT_EQ(snapshot()->signatures.size(), 0u);
    EXPECT_EQ(old->signatures.size(), 1u) << "a snapshot never changes";
    EXPECT_TRUE(index.refresh(parts.id, 999));
    EXPECT_TRUE(index.refresh(999, a.id)) << "a collection that is gone is no error";
}

// The order of threads must not matter: a late refresh cannot bring back a deleted shape.
TEST_F(Index, EndsAsTheStoreAfterConcurrentChanges) {
    std::vector<std::thread> threads;
    std::atomic<bool> stop{false};
    std::thread reader([&] {
        while (!stop) {
            const SnapshotPtr seen = snapshot();
            std::size_t count = 0;
            for (const auto& block : seen->signatures.blocks()) count += block->size();
            EXPECT_EQ(count, seen->signatures.size());
        }
    });
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            Random random(static_cast<std::uint64_t>(t));
            for (int i = 0; i < 400; ++i) {
                const std::string key = std::to_string(random.below(20));
                if (random.below(3) == 0) {
                    const auto deleted = store.deleteShape(parts.id, key, std::nullopt);
                    if (deleted) {
                        EXPECT_TRUE(index.refresh(parts.id, deleted->id));
                    }
                } else {
                    const auto points = taggedPoints(static_cast<float>(1 + random.below(100)));
                    const auto put = store.putShape(putRequest(parts.id, key, points));
                    ASSERT_TRUE(put);
                    while (const auto job = *store.claimJob()) {
                        const std::string bytes = encodeSignature(signatureOf(1.0 + t));
                        ASSERT_TRUE(store.finishJob(*job, {job->shapeId, job->pointsVersion, 1, bytes}));
                        EXPECT_TRUE(index.refresh(parts.id, job->shapeId));
                    }
                }
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    stop = true;
    reader.join();
    expectSameAsStore();
}

TEST_F(Index, RecoversFromAFailedReadWithTheNextUpdate) {
    const auto a = put("a", 1.0f);
    const auto b = put("b", 2.0f);
    store.fault = [](const std::string& function) -> std::optional<Error> {
        if (function == "getSignature") return Error{ErrorCode::kStorage, "disk gone"};
        return std::nullopt;
    };
    EXPECT_EQ(index.refresh(parts.id, a.id).error().code, ErrorCode::kStorage);
    store.fault = nullptr;
    ASSERT_TRUE(index.refresh(parts.id, b.id));
    expectSameAsStore();
    EXPECT_EQ(snapshot()->signatures.size(), 2u);
}

TEST_F(Index, DamagedSignatureIsLeftOutAndLogged) {
    const auto a = put("a", 1.0f);
    put("b", 2.0f);
    const auto points = taggedPoints(3.0f);
    ASSERT_TRUE(store.putShape(putRequest(parts.id, "c", points)));
    const auto job = *store.claimJob();
    ASSERT_TRUE(store.finishJob(*job, {job->shapeId, job->pointsVersion, 1, "damaged"}));
    ASSERT_TRUE(index.loadAll());
    EXPECT_EQ(snapshot()->signatures.size(), 2u);
    EXPECT_TRUE(snapshot()->signatures.find(a.id));
    EXPECT_NE(log->all().find("damaged"), std::string::npos) << log->all();
    EXPECT_NE(log->all().find("key=c"), std::string::npos) << log->all();
}

TEST_F(Index, ACollectionThatCannotBeReadIsMarkedAndTheOthersAreServed) {
    put("a", 1.0f);
    ASSERT_TRUE(store.createCollection("aaa", "", paperParameters()));  // read first
    int reads = 0;
    store.fault = [&](const std::string& function) -> std::optional<Error> {
        if (function != "loadIndex" || ++reads > 1) return std::nullopt;
        return Error{ErrorCode::kDataLoss, "a page is malformed"};
    };
    ASSERT_TRUE(index.loadAll());
    EXPECT_EQ(index.damaged(), 1u);
    EXPECT_FALSE(snapshot()->damage);
    EXPECT_EQ(snapshot()->signatures.size(), 1u);
    const auto damaged = (*index.byName("aaa"))->damage;
    ASSERT_TRUE(damaged);
    EXPECT_EQ(damaged->code, ErrorCode::kDataLoss);
    for (const char* word : {"'aaa'", "a page is malformed", "shapedb admin check", "--collection aaa"}) {
        EXPECT_NE(damaged->message.find(word), std::string::npos) << damaged->message;
        EXPECT_NE(log->all().find(word), std::string::npos) << log->all();
    }
    ASSERT_TRUE(index.reload((*index.byName("aaa"))->collection.id));
    EXPECT_EQ(index.damaged(), 0u) << "once it can be read again";
}

TEST_F(Index, OtherErrorsOfTheStoreEndTheLoading) {
    store.fault = [](const std::string& function) -> std::optional<Error> {
        if (function != "loadIndex") return std::nullopt;
        return Error{ErrorCode::kStorage, "no disk"};
    };
    EXPECT_EQ(index.loadAll().error().code, ErrorCode::kStorage);
}

TEST_F(Index, DamagedParametersTakeOutTheirCollectionAlone) {
    put("a", 1.0f);
    ASSERT_TRUE(store.createCollection("broken", "", "{}"));
    ASSERT_TRUE(index.loadAll());
    EXPECT_EQ(snapshot()->signatures.size(), 1u);
    EXPECT_FALSE(snapshot()->damage);
    EXPECT_TRUE(snapshot()->requireParameters());
    const auto broken = *index.byName("broken");
    ASSERT_TRUE(broken->damage);
    for (const char* word : {"'broken'", "parameters", "restore a backup", "--profile default"}) {
        EXPECT_NE(broken->damage->message.find(word), std::string::npos) << broken->damage->message;
    }
    EXPECT_EQ(broken->requireParameters().error().code, ErrorCode::kDataLoss);
    EXPECT_EQ(index.damaged(), 1u);
}

/// A store of which a page of the table of collections, or of the aliases, cannot be read.
class DamagedTables : public MemoryStore {
  public:
    Result<std::vector<store::Collection>> listCollections() override {
        auto all = MemoryStore::listCollections();
        const Error damage{ErrorCode::kDataLoss, "a page is malformed"};
        for (store::Collection& one : *all) {
            if (one.name == "lost" || one.name == "nameless") one.damage = damage;
            if (one.name == "nameless") one.name.clear();
        }
        return all;
    }
    Result<std::vector<store::Alias>> listAliases() override {
        if (aliasesAreLost) return fail(ErrorCode::kDataLoss, "a page is malformed");
        return MemoryStore::listAliases();
    }
    bool aliasesAreLost = false;
};

TEST(DamagedIndex, ARowThatCannotBeReadTakesOutItsCollectionAlone) {
    DamagedTables store;
    const auto log = std::make_shared<RecordingLogger>();
    CollectionIndex index(store, log);
    ASSERT_TRUE(store.createCollection("whole", "", paperParameters()));
    ASSERT_TRUE(store.createCollection("lost", "", paperParameters()));
    const auto nameless = *store.createCollection("nameless", "", paperParameters());
    ASSERT_TRUE(store.setAlias("known", nameless.id));
    ASSERT_TRUE(index.loadAll());
    EXPECT_FALSE((*index.byName("whole"))->damage);
    EXPECT_TRUE((*index.byName("lost"))->damage);
    EXPECT_TRUE((*index.byName("known"))->damage) << "by its alias";
    EXPECT_EQ(index.all().size(), 2u);
    EXPECT_EQ(index.damaged(), 2u);
    EXPECT_NE(log->all().find("alias=known"), std::string::npos) << log->all();
}

TEST(DamagedIndex, AliasesThatCannotBeReadAreNotTakenForNone) {
    DamagedTables store;
    CollectionIndex index(store, std::make_shared<RecordingLogger>());
    ASSERT_TRUE(store.createCollection("whole", "", paperParameters()));
    store.aliasesAreLost = true;
    ASSERT_TRUE(index.loadAll());
    EXPECT_TRUE(index.byName("whole"));
    EXPECT_EQ(index.byName("other").error().code, ErrorCode::kDataLoss);
    store.aliasesAreLost = false;
    ASSERT_TRUE(index.loadAll());
    EXPECT_EQ(index.byName("other").error().code, ErrorCode::kNotFound);
}

TEST_F(Index, LoadingCanBeCancelled) {
    put("a", 1.0f);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(index.loadAll(context).error().code, ErrorCode::kCancelled);
}

TEST_F(Index, KeepsTheGenerationDuringACommit) {
    bool called = false;
    EXPECT_TRUE(index.whileGeneration(parts.id, 1, [&] { called = true; }));
    EXPECT_TRUE(called);
    EXPECT_FALSE(index.whileGeneration(parts.id, 2, [] { FAIL(); }));
    EXPECT_FALSE(index.whileGeneration(999, 1, [] { FAIL(); }));
}

TEST_F(Index, SwitchingReloadsParametersAndSignaturesTogether) {
    const auto a = put("a", 1.0f);
    ASSERT_TRUE(index.refresh(parts.id, a.id));
    const auto rebuild = store.startRebuild(parts.id, paperParameters(3));
    ASSERT_TRUE(rebuild);
    const auto notYet = index.switchGeneration(parts.id, [&] { return store.finishRebuild(rebuild->id); });
    ASSERT_TRUE(notYet);
    EXPECT_FALSE(*notYet);
    EXPECT_EQ(snapshot()->collection.generation, 1);

    ASSERT_TRUE(store.putRebuilt(rebuild->id, {a.id, 1, 2, encodeSignature(signatureOf(9.0))}));
    const auto done = index.switchGeneration(parts.id, [&] { return store.finishRebuild(rebuild->id); });
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_TRUE(*done);
    EXPECT_EQ(snapshot()->collection.generation, 2);
    EXPECT_EQ(snapshot()->parameters.signature.maxPoints, 3u);
    const SnapshotPtr switched = snapshot();
    const auto place = switched->signatures.find(a.id);
    ASSERT_TRUE(place);
    EXPECT_TRUE(sameShape(place.block->rows()[place.row], PackedShape(signatureOf(9.0)).row()));
    EXPECT_FALSE(index.whileGeneration(parts.id, 1, [] { FAIL(); }));
    EXPECT_EQ(index.switchGeneration(999, [] { return Result<bool>(true); }).error().code,
              ErrorCode::kNotFound);
}

TEST_F(Index, RepeatsAFailedReloadBeforeTheNextCommit) {
    const auto a = put("a", 1.0f);
    const auto rebuild = store.startRebuild(parts.id, paperParameters(3));
    ASSERT_TRUE(store.putRebuilt(rebuild->id, {a.id, 1, 2, encodeSignature(signatureOf(9.0))}));
    store.fault = [](const std::string& function) -> std::optional<Error> {
        if (function == "loadIndex") return Error{ErrorCode::kStorage, "disk gone"};
        return std::nullopt;
    };
    EXPECT_FALSE(index.switchGeneration(parts.id, [&] { return store.finishRebuild(rebuild->id); }));
    EXPECT_FALSE(index.whileGeneration(parts.id, 1, [] { FAIL() << "a signature of the old parameters"; }));
    store.fault = nullptr;
    EXPECT_FALSE(index.whileGeneration(parts.id, 1, [] { FAIL() << "still the old parameters"; }));
    EXPECT_TRUE(index.whileGeneration(parts.id, 2, [] {}));
    expectSameAsStore();
}

}  // namespace
}  // namespace shapedb::index
