// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of many shapes, on a catalog with a memory store.
#include "server/catalog/bulk_changes.h"

#include <atomic>
#include <functional>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "server/catalog/limits.h"
#include "server/catalog/listing.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;
using store::MetadataChange;

/// Calls back when a listing of shapes has been read, outside all locks.
class ReportingStore : public MemoryStore {
  public:
    using MemoryStore::listShapes;
    Result<std::vector<store::Shape>> listShapes(std::int64_t collectionId,
                                                 const store::ShapeListing& listing, std::size_t limit,
                                                 const store::ShapeFilter& filter) override {
        auto page = MemoryStore::listShapes(collectionId, listing, limit, filter);
        if (afterRead && *afterRead) (*afterRead)();
        return page;
    }
    std::function<void()>* afterRead = nullptr;
};

class BulkChanges : public ::testing::Test {
  protected:
    BulkChanges() { restart(1'000); }
    ~BulkChanges() override { EXPECT_TRUE(catalog->stop()); }

    void restart(std::uint64_t maxQueuedJobs) {
        if (catalog) {
            EXPECT_TRUE(catalog->stop());
        }
        auto owned = std::make_unique<ReportingStore>();
        owned->afterRead = &afterRead;
        owned->fault = [this](const std::string& function) -> std::optional<Error> {
            if (function == "claimJob" && noJobs) return Error{ErrorCode::kStorage, "broken"};
            if (before) before(function);
            return std::nullopt;
        };
        CatalogOptions options;
        options.maxQueuedJobs = maxQueuedJobs;
        catalog = std::make_unique<Catalog>(std::move(owned), quickDescribe,
                                            std::make_shared<RecordingLogger>(), options);
        ASSERT_TRUE(catalog->start());
    }

    store::Shape put(const std::string& key, float tag, Metadata metadata = {}) {
        ShapeHeader header;
        header.key = key;
        header.metadata = store::replacedBy(std::move(metadata));
        auto added = catalog->put(header, store::VerifiedScan::verify(taggedPoints(tag)).value());
        EXPECT_TRUE(added) << added.error().message;
        return catalog->awaitIngest(added->shape, [] { return Result<void>(); }).value();
    }
    index::SnapshotPtr snapshot() { return catalog->collection("").value(); }
    static ChangeTarget byKeys(std::vector<std::string> keys) { return {std::move(keys), std::nullopt}; }
    static ChangeTarget byFilter(const std::string& filter) { return {std::nullopt, filter}; }
    std::uint64_t count(const std::string& filter = "") {
        return countSelected(*catalog, *snapshot(), {filter, std::nullopt}, {}).value();
    }
    Metadata searchedMetadata(const std::string& key) {
        const auto collection = snapshot();
        const auto place = collection->signatures.find(catalog->findShape(collection, key).value().shape.id);
        return place ? place.block->metadata(place.row) : Metadata{{"not", "searched"}};
    }

    std::atomic<bool> noJobs{false};
    std::function<void(const std::string& function)> before;
    std::function<void()> afterRead;
    std::unique_ptr<Catalog> catalog;
};

TEST_F(BulkChanges, DeletesWhatPassesTheFilterAndNothingElse) {
    for (int i = 0; i < 300; ++i) {
        put("k" + std::to_string(i), 1.0f + static_cast<float>(i), {{"third", std::to_string(i % 3)}});
    }
    const auto deleted = deleteShapes(*catalog, *snapshot(), byFilter("third=1"), {});
    ASSERT_TRUE(deleted) << deleted.error().message;
    EXPECT_EQ(deleted->deleted, 100u);
    EXPECT_EQ(count(), 200u);
    EXPECT_EQ(count("third=1"), 0u);
    EXPECT_EQ(snapshot()->signatures.size(), 200u) << "they left the searches";
    EXPECT_EQ(deleteShapes(*catalog, *snapshot(), byFilter("third=1"), {})->deleted, 0u);
    EXPECT_EQ(deleteShapes(*catalog, *snapshot(), byFilter(""), {})->deleted, 200u);
    EXPECT_EQ(deleteShapes(*catalog, *snapshot(), byFilter(""), {})->deleted, 0u);
}

TEST_F(BulkChanges, NamesTheKeysThatNoShapeHas) {
    put("a", 1.0f);
    put("b", 2.0f);
    const auto deleted = deleteShapes(*catalog, *snapshot(), byKeys({"b", "x", "b", "y"}), {});
    ASSERT_TRUE(deleted);
    EXPECT_EQ(deleted->deleted, 1u);
    EXPECT_EQ(deleted->missing, (std::vector<std::string>{"x", "y"}));
    EXPECT_EQ(count(), 1u);
}

TEST_F(BulkChanges, RefusesATargetThatIsNone) {
    put("a", 1.0f);
    const auto refused = [&](const ChangeTarget& target, ErrorCode code) {
        const auto deleted = deleteShapes(*catalog, *snapshot(), target, {});
        ASSERT_FALSE(deleted);
        EXPECT_EQ(deleted.error().code, code) << deleted.error().message;
    };
    refused({}, ErrorCode::kInvalidArgument);
    refused({std::vector<std::string>{"a"}, std::string()}, ErrorCode::kInvalidArgument);
    refused(byKeys({}), ErrorCode::kInvalidArgument);
    refused(byKeys({"a", ""}), ErrorCode::kInvalidArgument);
    refused(byKeys(std::vector<std::string>(kMaxKeys + 1, "a")), ErrorCode::kInvalidArgument);
    refused(byFilter("a b"), ErrorCode::kMalformedFilter);
    EXPECT_EQ(count(), 1u);
}

// Between the read that found it and the transaction.
TEST_F(BulkChanges, LeavesAShapeThatChangedMeanwhile) {
    put("a", 1.0f, {{"label", "old"}});
    put("b", 2.0f, {{"label", "old"}});
    const auto a = catalog->findShape(snapshot(), "a").value().shape;
    int reads = 0;
    afterRead = [&] {
        if (++reads != 2) return;  // the first looks for the last id
        ASSERT_TRUE(catalog->changeMetadata(catalog->epoch(), {a.id}, [](const store::Shape&) {
            return Metadata{{"label", "new"}};
        }));
    };
    const auto deleted = deleteShapes(*catalog, *snapshot(), byFilter("label=old"), {});
    afterRead = nullptr;
    ASSERT_TRUE(deleted) << deleted.error().message;
    EXPECT_EQ(deleted->deleted, 1u);
    EXPECT_TRUE(catalog->findShape(snapshot(), "a"));
}

TEST_F(BulkChanges, StopsBetweenTransactionsWhenCancelled) {
    for (int i = 0; i < 300; ++i) put("k" + std::to_string(i), 1.0f + static_cast<float>(i));
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    before = [&](const std::string& function) {
        if (function == "deleteShapes") cancel = true;
    };
    const auto deleted = deleteShapes(*catalog, *snapshot(), byFilter(""), context);
    before = nullptr;
    ASSERT_FALSE(deleted);
    EXPECT_EQ(deleted.error().code, ErrorCode::kCancelled);
    EXPECT_EQ(count(), 300u - kShapesPerChange) << "what was deleted stays deleted";
    EXPECT_EQ(snapshot()->signatures.size(), 300u - kShapesPerChange);
}

TEST_F(BulkChanges, DoesNotChaseWhatIsAddedMeanwhile) {
    for (int i = 0; i < 150; ++i) put("k" + std::to_string(i), 1.0f + static_cast<float>(i));
    int added = 0;
    afterRead = [&] {
        ShapeHeader header;
        header.key = "later" + std::to_string(added++);
        ASSERT_TRUE(catalog->put(header, store::VerifiedScan::verify(taggedPoints(7.0f)).value()));
    };
    const auto deleted = deleteShapes(*catalog, *snapshot(), byFilter(""), {});
    afterRead = nullptr;
    ASSERT_TRUE(deleted) << deleted.error().message;
    EXPECT_EQ(deleted->deleted, 150u);
    EXPECT_GE(added, 2);
    EXPECT_EQ(count(), static_cast<std::uint64_t>(added));
}

TEST_F(BulkChanges, MergesRemovesAndReplacesMetadata) {
    put("a", 1.0f, {{"label", "cup"}, {"year", "1990"}});
    put("b", 2.0f, {{"label", "cup"}});
    put("c", 3.0f, {{"label", "jug"}});
    const auto change = [&](const std::string& filter, const MetadataChange& wanted) {
        const auto result = changeMetadata(*catalog, *snapshot(), filter, wanted, {});
        EXPECT_TRUE(result) << result.error().message;
        return *result;
    };
    const auto merged = change("label=cup", {{{"year", "2004"}}, {}, false});
    EXPECT_EQ(merged.changed, 2u);
    EXPECT_EQ(searchedMetadata("a"), (Metadata{{"label", "cup"}, {"year", "2004"}})) << "searched at once";
    EXPECT_EQ(searchedMetadata("b"), (Metadata{{"label", "cup"}, {"year", "2004"}}));
    EXPECT_EQ(searchedMetadata("c"), (Metadata{{"label", "jug"}}));
    const auto again = change("label=cup", {{{"year", "2004"}}, {}, false});
    EXPECT_EQ(again.changed, 0u);
    EXPECT_EQ(again.unchanged, 2u);
    EXPECT_EQ(catalog->findShape(snapshot(), "a")->shape.version, 2);
    EXPECT_EQ(change("", {{}, {"year", "none"}, false}).changed, 2u);
    EXPECT_EQ(change("", {{{"x", "y"}}, {}, true}).changed, 3u);
    EXPECT_EQ(searchedMetadata("a"), (Metadata{{"x", "y"}}));
    EXPECT_EQ(change("", {{}, {}, true}).changed, 3u);
    EXPECT_EQ(searchedMetadata("a"), Metadata());
    EXPECT_EQ(catalog->findShape(snapshot(), "a")->shape.state, store::ShapeState::kReady);
}

TEST_F(BulkChanges, ReplacingAllLeavesWhatDescribesThePoints) {
    put("a", 1.0f, {{"label", "cup"}, {"shapedb.offset", "1 2 3"}, {"shapedc", "x"}});
    const MetadataChange all{{{"x", "y"}}, {}, true};
    ASSERT_TRUE(changeMetadata(*catalog, *snapshot(), "", all, {}));
    EXPECT_EQ(searchedMetadata("a"), (Metadata{{"x", "y"}, {"shapedb.offset", "1 2 3"}}));
    ASSERT_TRUE(changeMetadataOf(*catalog, snapshot(), "a", {{}, {}, true}, {}));
    EXPECT_EQ(searchedMetadata("a"), (Metadata{{"shapedb.offset", "1 2 3"}}));
    ASSERT_TRUE(changeMetadataOf(*catalog, snapshot(), "a", {{{"shapedb.offset", "0 0 0"}}, {}, true}, {}));
    EXPECT_EQ(searchedMetadata("a"), (Metadata{{"shapedb.offset", "0 0 0"}}));
    ASSERT_TRUE(changeMetadataOf(*catalog, snapshot(), "a", {{}, {"shapedb.offset"}, false}, {}));
    EXPECT_EQ(searchedMetadata("a"), Metadata());
}

TEST_F(BulkChanges, OneFullShapeDoesNotKeepTheOthersFromChanging) {
    Metadata full;
    for (std::size_t i = 0; i < kMaxMetadataEntries; ++i) full["m" + std::to_string(i)] = "v";
    put("a", 1.0f);
    put("full", 2.0f, full);
    put("z", 3.0f);
    const auto result = changeMetadata(*catalog, *snapshot(), "", {{{"label", "cup"}}, {}, false}, {});
    ASSERT_TRUE(result);
    EXPECT_EQ(result->changed, 2u);
    EXPECT_EQ(result->refused, 1u);
    EXPECT_EQ(result->firstRefusedKey, "full");
    EXPECT_EQ(result->firstRefused->code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(searchedMetadata("full"), full);
    const auto one = changeMetadataOf(*catalog, snapshot(), "full", {{{"label", "cup"}}, {}, false}, {});
    EXPECT_EQ(one.error().code, ErrorCode::kInvalidArgument);
    EXPECT_TRUE(changeMetadataOf(*catalog, snapshot(), "full", {{{"m0", "w"}}, {"m1"}, false}, {}));
}

TEST_F(BulkChanges, RefusesAChangeThatContradictsItself) {
    put("a", 1.0f);
    for (const MetadataChange& bad :
         {MetadataChange{{{"x", "y"}}, {"x"}, false}, MetadataChange{{}, {"x"}, true},
          MetadataChange{{{"a b", ""}}, {}, false}, MetadataChange{{}, {"a b"}, false},
          MetadataChange{{{"k", std::string(1'025, 'v')}}, {}, false}}) {
        EXPECT_EQ(changeMetadata(*catalog, *snapshot(), "", bad, {}).error().code,
                  ErrorCode::kInvalidArgument);
        EXPECT_EQ(changeMetadataOf(*catalog, snapshot(), "a", bad, {}).error().code,
                  ErrorCode::kInvalidArgument);
    }
    EXPECT_EQ(catalog->findShape(snapshot(), "a")->shape.version, 1);
}

TEST_F(BulkChanges, AnExpectedVersionIsObeyedAndARepetitionRecognised) {
    put("a", 1.0f);
    const MetadataChange change{{{"label", "cup"}}, {}, false};
    const auto update = [&](const std::string& key, std::optional<std::int64_t> expected) {
        return changeMetadataOf(*catalog, snapshot(), key, change, expected);
    };
    EXPECT_EQ(update("none", {}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(update("a", -1).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(update("a", 7).error().code, ErrorCode::kVersionConflict);
    const auto changed = update("a", 1);
    ASSERT_TRUE(changed);
    EXPECT_TRUE(changed->changed);
    EXPECT_EQ(changed->shape.version, 2);
    const auto repeated = update("a", 1);
    ASSERT_TRUE(repeated) << "its reply may have been lost";
    EXPECT_FALSE(repeated->changed);
    EXPECT_EQ(repeated->shape.version, 2);
    EXPECT_FALSE(update("a", {})->changed);
}

TEST_F(BulkChanges, RetriesFailedShapes) {
    put("good", 1.0f);
    put("bad", -1.0f, {{"label", "cup"}});
    put("worse", -2.0f);
    const auto retried = retryShapes(*catalog, *snapshot(), byKeys({"good", "bad", "none"}), {});
    ASSERT_TRUE(retried) << retried.error().message;
    EXPECT_EQ(retried->queued, 1u);
    EXPECT_EQ(retried->left, 0u);
    EXPECT_EQ(retried->notFailed, std::vector<std::string>{"good"});
    EXPECT_EQ(retried->missing, std::vector<std::string>{"none"});
    const auto bad = catalog->findShape(snapshot(), "bad").value().shape;
    EXPECT_EQ(catalog->awaitIngest(bad, [] { return Result<void>(); })->state, store::ShapeState::kFailed)
        << "segmented again, to the same end";
    EXPECT_EQ(retryShapes(*catalog, *snapshot(), byFilter("label=cup"), {})->queued, 1u);
    EXPECT_EQ(retryShapes(*catalog, *snapshot(), byFilter("label=jug"), {})->queued, 0u);
}

TEST_F(BulkChanges, SaysHowManyTheQueueHadNoRoomFor) {
    restart(3);
    for (int i = 0; i < 5; ++i) put("bad" + std::to_string(i), -1.0f - static_cast<float>(i));
    noJobs = true;  // the queue does not get shorter
    const auto retried = retryShapes(*catalog, *snapshot(), byFilter(""), {});
    ASSERT_TRUE(retried) << retried.error().message;
    EXPECT_EQ(retried->queued, 3u);
    EXPECT_EQ(retried->left, 2u);
    EXPECT_EQ(retryShapes(*catalog, *snapshot(), byFilter(""), {}).error().code, ErrorCode::kQueueFull);
    EXPECT_EQ(retryShapes(*catalog, *snapshot(), byKeys({"bad4"}), {}).error().code, ErrorCode::kQueueFull);
    noJobs = false;
}

// The ids of one content must not be used on another.
TEST_F(BulkChanges, EndsWhenTheContentIsReplaced) {
    put("a", 1.0f);
    ASSERT_TRUE(catalog->backup("backup", {}));
    const auto epoch = catalog->epoch();
    const auto id = catalog->findShape(snapshot(), "a").value().shape.id;
    ASSERT_TRUE(catalog->restore("backup", {}));
    const auto all = [](const store::Shape&) { return true; };
    EXPECT_EQ(catalog->deleteShapes(epoch, {id}, all).error().code, ErrorCode::kUnavailable);
    EXPECT_EQ(catalog->retryShapes(epoch, {id}).error().code, ErrorCode::kUnavailable);
    EXPECT_EQ(
        catalog->changeMetadata(epoch, {id}, [](const store::Shape&) { return Metadata(); }).error().code,
        ErrorCode::kUnavailable);
    EXPECT_EQ(count(), 1u);
}

TEST_F(BulkChanges, AnUploadWithoutMetadataLeavesThem) {
    put("a", 1.0f, {{"label", "cup"}});
    ShapeHeader header;
    header.key = "a";
    const auto upload = [&](float tag) {
        return catalog->put(header, store::VerifiedScan::verify(taggedPoints(tag)).value());
    };
    EXPECT_EQ(upload(1.0f)->outcome, store::PutOutcome::kUnchanged);
    const auto replaced = upload(2.0f);
    EXPECT_EQ(replaced->outcome, store::PutOutcome::kReplaced);
    EXPECT_EQ(replaced->shape.metadata, (Metadata{{"label", "cup"}}));
    header.metadata = {{{"year", "2004"}}, {"label", "none"}, false};
    EXPECT_EQ(upload(2.0f)->shape.metadata, (Metadata{{"year", "2004"}}));
    header.metadata = store::replacedBy({});
    EXPECT_EQ(upload(2.0f)->outcome, store::PutOutcome::kMetadataChanged);
    EXPECT_EQ(catalog->findShape(snapshot(), "a")->shape.metadata, Metadata());
    // What it would have together with what it has.
    header.metadata = {};
    for (std::size_t i = 0; i < kMaxMetadataEntries; ++i) header.metadata.set["m" + std::to_string(i)] = "v";
    ASSERT_TRUE(upload(2.0f));
    header.metadata = {{{"one", "more"}}, {}, false};
    ASSERT_TRUE(catalog->admitUpload(header));
    EXPECT_EQ(upload(2.0f).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(BulkChanges, OtherPointsUnderAKeyCanBeRefused) {
    put("a", 1.0f);
    ShapeHeader header;
    header.key = "a";
    header.mode = store::PutMode::kSamePoints;
    header.metadata = store::replacedBy({{"label", "cup"}});
    const auto upload = [&](float tag) {
        return catalog->put(header, store::VerifiedScan::verify(taggedPoints(tag)).value());
    };
    EXPECT_EQ(upload(2.0f).error().code, ErrorCode::kAlreadyExists);
    EXPECT_EQ(upload(1.0f)->outcome, store::PutOutcome::kMetadataChanged);
    EXPECT_EQ(upload(1.0f)->outcome, store::PutOutcome::kUnchanged);
    header.key = "b";
    EXPECT_EQ(upload(2.0f)->outcome, store::PutOutcome::kCreated);
}

TEST_F(BulkChanges, CountsByValueAreThoseOfAPlainCount) {
    Random random(4);
    std::map<std::string, std::uint64_t> plain;
    std::uint64_t without = 0;
    for (int i = 0; i < 200; ++i) {
        Metadata metadata;
        if (random.below(5) > 0) metadata["label"] = "l" + std::to_string(random.below(12));
        if (random.below(2) == 0) metadata["half"] = "yes";
        put("k" + std::to_string(i), 1.0f, metadata);
        if (metadata.count("half") == 0) continue;
        if (metadata.count("label") > 0) {
            ++plain[metadata.at("label")];
        } else {
            ++without;
        }
    }
    for (const std::uint32_t most : {1u, 5u, 0u}) {
        const auto counts = countByValue(*catalog, *snapshot(), {"half", std::nullopt}, "label", most, {});
        ASSERT_TRUE(counts) << counts.error().message;
        EXPECT_EQ(counts->without, without);
        std::set<std::string> named;
        std::uint64_t sum = counts->otherShapes;
        for (std::size_t i = 0; i < counts->values.size(); ++i) {
            const ValueCount& one = counts->values[i];
            EXPECT_EQ(one.shapes, plain.at(one.value));
            EXPECT_TRUE(named.insert(one.value).second);
            sum += one.shapes;
            if (i == 0) continue;
            const ValueCount& last = counts->values[i - 1];
            EXPECT_TRUE(last.shapes > one.shapes || (last.shapes == one.shapes && last.value < one.value));
        }
        EXPECT_EQ(named.size() + counts->otherValues, plain.size());
        EXPECT_EQ(named.size(), most == 0 ? plain.size() : most);
        for (const auto& [value, shapes] : plain) {
            sum -= shapes;
            if (named.count(value) == 0) {
                EXPECT_LE(shapes, counts->values.back().shapes) << value;
            }
        }
        EXPECT_EQ(sum, 0u);
    }
    const auto refused = [&](const std::string& key, std::uint32_t most) {
        return countByValue(*catalog, *snapshot(), {}, key, most, {}).error().code;
    };
    EXPECT_EQ(refused("", 0), ErrorCode::kInvalidArgument);
    EXPECT_EQ(refused("a b", 0), ErrorCode::kInvalidArgument);
    EXPECT_EQ(refused("label", kMaxValues + 1), ErrorCode::kInvalidArgument);
}

TEST_F(BulkChanges, ListsInTheOrderAskedFor) {
    for (const char* key : {"b/1", "a/2", "a/1", "c"}) put(key, 1.0f);
    const auto keys = [&](store::ShapeOrder order, bool descending, const std::string& prefix) {
        std::vector<std::string> all;
        ListRequest request;
        request.order = order;
        request.descending = descending;
        request.selection.keyPrefix = prefix;
        request.pageSize = 1;
        do {
            const auto next = listPage(*catalog, *snapshot(), request, {},
                                       [&](const store::Shape& shape, std::optional<double>) {
                                           all.push_back(shape.key);
                                           return std::size_t{1};
                                       });
            EXPECT_TRUE(next) << next.error().message;
            request.cursor = *next;
        } while (!request.cursor.empty());
        return all;
    };
    using Keys = std::vector<std::string>;
    EXPECT_EQ(keys(store::ShapeOrder::kId, true, ""), (Keys{"c", "a/1", "a/2", "b/1"}));
    EXPECT_EQ(keys(store::ShapeOrder::kKey, false, ""), (Keys{"a/1", "a/2", "b/1", "c"}));
    EXPECT_EQ(keys(store::ShapeOrder::kKey, true, "a/"), (Keys{"a/2", "a/1"}));
    EXPECT_EQ(keys(store::ShapeOrder::kUpdated, false, "a").size(), 2u);
    ListRequest request;
    request.selection.keyPrefix = "\xff";
    EXPECT_EQ(listPage(*catalog, *snapshot(), request, {}, [](const auto&, auto) { return 0; }).error().code,
              ErrorCode::kInvalidArgument);
}

TEST_F(BulkChanges, AnAliasNamesACollectionWhereverOneIsTaken) {
    ASSERT_TRUE(catalog->createCollection("old", "", parametersOf(Profile::kPaper)));
    ASSERT_TRUE(catalog->createCollection("new", "", parametersOf(Profile::kPaper)));
    EXPECT_EQ(catalog->setAlias("live", "old").value()->collection.name, "old");
    EXPECT_EQ(catalog->collection("live").value()->collection.name, "old");
    EXPECT_EQ(catalog->setAlias("live", "new").value()->collection.name, "new");
    EXPECT_EQ(catalog->collection("live").value()->collection.name, "new");
    EXPECT_EQ(catalog->setAlias("other", "live").value()->collection.name, "new") << "by its alias";
    EXPECT_EQ(catalog->aliasesOf(*catalog->collection("new").value()),
              (std::vector<std::string>{"live", "other"}));
    EXPECT_EQ(catalog->setAlias("old", "new").error().code, ErrorCode::kAlreadyExists);
    EXPECT_EQ(catalog->setAlias("live", "none").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(catalog->setAlias("a b", "new").error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(catalog->createCollection("live", "", parametersOf(Profile::kPaper)).error().code,
              ErrorCode::kAlreadyExists);
    EXPECT_EQ(catalog->deleteCollection("live", true).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(catalog->renameCollection("live", "x").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(catalog->deleteAlias("new").error().code, ErrorCode::kNotFound) << "a collection";
    ASSERT_TRUE(catalog->deleteAlias("other"));
    EXPECT_EQ(catalog->collection("other").error().code, ErrorCode::kNotFound);
    ASSERT_TRUE(catalog->backup("backup", {}));
    ASSERT_TRUE(catalog->deleteCollection("new", true));
    EXPECT_EQ(catalog->collection("live").error().code, ErrorCode::kNotFound) << "gone with its collection";
    ASSERT_TRUE(catalog->restore("backup", {}));
    EXPECT_EQ(catalog->collection("live").value()->collection.name, "new");
}

TEST_F(BulkChanges, ARenamedCollectionKeepsEverything) {
    ASSERT_TRUE(catalog->createCollection("parts", "", parametersOf(Profile::kPaper)));
    ShapeHeader header;
    header.collection = "parts";
    header.key = "cup";
    const auto added = catalog->put(header, store::VerifiedScan::verify(taggedPoints(5.0f)).value());
    ASSERT_TRUE(added);
    ASSERT_TRUE(catalog->awaitIngest(added->shape, [] { return Result<void>(); }));
    ASSERT_TRUE(catalog->setAlias("live", "parts"));
    EXPECT_EQ(catalog->renameCollection("parts", "default").error().code, ErrorCode::kAlreadyExists);
    EXPECT_EQ(catalog->renameCollection("default", "x").error().code, ErrorCode::kRejected);
    EXPECT_EQ(catalog->renameCollection("none", "x").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(catalog->renameCollection("parts", "").error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(catalog->renameCollection("parts", "pieces").value()->collection.name, "pieces");
    EXPECT_EQ(catalog->collection("parts").error().code, ErrorCode::kNotFound);
    const auto pieces = catalog->collection("pieces").value();
    EXPECT_EQ(catalog->collection("live").value()->collection.name, "pieces");
    EXPECT_EQ(cachedVolume(pieces->signatures, added->shape.id), 5.0);
    EXPECT_EQ(catalog->reload("pieces").value()->collection.name, "pieces");
    EXPECT_TRUE(catalog->findShape(pieces, "cup"));
    ASSERT_TRUE(catalog->createCollection("parts", "", parametersOf(Profile::kPaper))) << "free again";
}

}  // namespace
}  // namespace shapedb::catalog
