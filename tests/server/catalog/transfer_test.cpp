// SPDX-License-Identifier: GPL-3.0-or-later
// The rules around export and import of one collection.
#include <atomic>

#include <gtest/gtest.h>

#include "server/catalog/catalog.h"
#include "server/store/parameters_codec.h"
#include "tests/server/support/fixtures.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::catalog {
namespace {

using namespace shapedb::testing;

class CatalogTransferTest : public ::testing::Test {
  protected:
    CatalogTransferTest() {
        auto owned = std::make_unique<MemoryStore>();
        store = owned.get();
        store->fault = [this](const std::string& function) -> std::optional<Error> {
            if (function == failing.load()) return Error{ErrorCode::kStorage, "broken"};
            return std::nullopt;
        };
        CatalogOptions options;
        options.maxQueuedJobs = 1;
        options.maxPoints = taggedPoints(5.0f).size() / 3;
        catalog = std::make_unique<Catalog>(std::move(owned), quickDescribe,
                                            std::make_shared<RecordingLogger>(), options);
        EXPECT_TRUE(catalog->start());
    }
    ~CatalogTransferTest() override { EXPECT_TRUE(catalog->stop()); }

    /// A file with one collection that holds one shape, which is pending.
    std::string fileOf(const std::string& itsParameters, const Metadata& metadata = {}) {
        const auto made = store->createCollection("made", "", itsParameters).value();
        store::PutRequest put(store::VerifiedScan::verify(taggedPoints(5.0f)).value());
        put.collectionId = made.id;
        put.key = "cup";
        put.metadata = store::replacedBy(metadata);
        EXPECT_TRUE(store->putShape(put));
        const std::string file = "file" + std::to_string(++files);
        EXPECT_TRUE(store->exportCollection(made.id, file, {}));
        EXPECT_TRUE(store->deleteCollection(made.id));
        return file;
    }
    Result<index::SnapshotPtr> bring(const std::string& file, const std::string& name) {
        return catalog->importCollection(file, name,
                                         [this](const std::string& wanted) {
                                             asked.push_back(wanted);
                                             return mayUse;
                                         },
                                         {});
    }
    void expectOnlyDefault() {
        EXPECT_EQ(catalog->collections()->size(), 1u);
        EXPECT_EQ(store->listCollections()->size(), 1u);
        EXPECT_EQ(store->queueDepth()->jobs, 0u);
    }

    const std::string parameters = store::encodeParameters(parametersOf(Profile::kDefault));
    MemoryStore* store = nullptr;
    std::atomic<const char*> failing{""};  ///< workers ask too
    Result<void> mayUse;
    std::vector<std::string> asked;
    int files = 0;
    std::unique_ptr<Catalog> catalog;
};

TEST_F(CatalogTransferTest, WorkersAndSearchesGetWhatIsImported) {
    const auto imported = bring(fileOf(parameters), "");
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(asked, (std::vector<std::string>{"made", "made"}))
        << "before anything is stored, and at the end";
    const auto found = catalog->findShape(catalog->collection("made").value(), "cup");
    ASSERT_TRUE(found);
    ASSERT_TRUE(catalog->awaitIngest(found->shape, [] { return Result<void>(); }));
    EXPECT_EQ(cachedVolume(catalog->collection("made").value()->signatures, found->shape.id), 5.0);

    ASSERT_TRUE(catalog->exportCollection("made", "again", {}));
    EXPECT_EQ(catalog->exportCollection("nothing", "x", {}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(catalog->admitImport("made").error().code, ErrorCode::kAlreadyExists);
    EXPECT_EQ(catalog->admitImport("not/this").error().code, ErrorCode::kInvalidArgument);
    ASSERT_TRUE(catalog->admitImport("second"));
    const auto second = bring("again", "second").value();
    ASSERT_EQ(second->signatures.size(), 1u) << "searched as soon as it is there";
    EXPECT_EQ(store->queueDepth()->jobs, 0u);
    ASSERT_TRUE(catalog->deleteCollection("made", true));
    EXPECT_EQ(catalog->collection("second").value()->signatures.size(), 1u);
}

TEST_F(CatalogTransferTest, RefusesWhatNoClientCouldHaveMade) {
    const auto refused = [&](const std::string& file, const std::string& name, ErrorCode code) {
        const auto imported = bring(file, name);
        ASSERT_FALSE(imported);
        EXPECT_EQ(imported.error().code, code) << imported.error().message;
        expectOnlyDefault();
    };
    refused(fileOf("unheard of"), "new", ErrorCode::kMalformedFile);
    refused(fileOf(parameters, {{"a b", "blank"}}), "new", ErrorCode::kInvalidArgument);
    refused(fileOf(parameters), "default", ErrorCode::kAlreadyExists);
    refused(fileOf(parameters), ".import", ErrorCode::kInvalidArgument);
    refused("missing", "new", ErrorCode::kFileNotReadable);
    mayUse = fail(ErrorCode::kPermissionDenied, "not yours");
    refused(fileOf(parameters), "new", ErrorCode::kPermissionDenied);
}

TEST_F(CatalogTransferTest, TakesMorePendingShapesThanTheQueueTakesUploads) {
    const auto made = store->createCollection("made", "", parameters).value();
    for (const char* key : {"a", "b", "c"}) {
        store::PutRequest put(store::VerifiedScan::verify(taggedPoints(5.0f)).value());
        put.collectionId = made.id;
        put.key = key;
        ASSERT_TRUE(store->putShape(put));
    }
    ASSERT_TRUE(store->exportCollection(made.id, "three", {}));
    ASSERT_TRUE(store->deleteCollection(made.id));
    const auto imported = bring("three", "copy");
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(catalog->countShapes(**imported)->all, 3u);
}

TEST_F(CatalogTransferTest, RefusesAShapeWithMorePointsThanTheServerTakes) {
    const auto made = store->createCollection("made", "", parameters).value();
    std::vector<float> points = taggedPoints(5.0f);
    points.insert(points.end(), {7.0f, 8.0f, 9.0f});
    store::PutRequest put(store::VerifiedScan::verify(points).value());
    put.collectionId = made.id;
    put.key = "large";
    ASSERT_TRUE(store->putShape(put));
    ASSERT_TRUE(store->exportCollection(made.id, "export", {}));
    ASSERT_TRUE(store->deleteCollection(made.id));
    const auto refused = bring("export", "copy");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kPointLimitExceeded);
    for (const std::string& word :
         {std::string("'large'"), std::to_string(points.size() / 3), std::to_string(points.size() / 3 - 1),
          std::string("limits.max_points")}) {
        EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
    }
    expectOnlyDefault();
}

TEST_F(CatalogTransferTest, AFailureAtTheEndLeavesNothingInTheIndex) {
    for (const char* function : {"loadIndex", "finishImport"}) {
        const std::string file = fileOf(parameters);
        failing = function;
        EXPECT_EQ(bring(file, "new").error().code, ErrorCode::kStorage) << function;
        failing = "";
        expectOnlyDefault();
        EXPECT_EQ(catalog->collection("new").error().code, ErrorCode::kNotFound);
        ASSERT_TRUE(bring(file, "new")) << function;
        ASSERT_TRUE(catalog->deleteCollection("new", true));
    }
}

}  // namespace
}  // namespace shapedb::catalog
