// SPDX-License-Identifier: GPL-3.0-or-later
// Export and import of one collection.
#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/store/transfer_fixture.h"

namespace shapedb::store {
namespace {

/// What a collection holds, written down by hand: a plain reference.
struct Held {
    std::string key;
    std::uint64_t seed = 0;  ///< of its points
    std::int64_t version = 1;
    std::int64_t pointsVersion = 1;
    ShapeState state = ShapeState::kPending;
    Metadata metadata;
    std::string signature;  ///< that serves; empty: none
};

/// Of every third scan.
Point3 originOf(std::uint64_t seed) {
    return seed % 3 == 0 ? Point3{1e6 + static_cast<double>(seed), -2.5e6, 0.1} : Point3{};
}

void expectHolds(Store& store, std::int64_t collectionId, const std::vector<Held>& held) {
    const auto shapes = store.listShapes(collectionId, 0, 1000, {}).value();
    ASSERT_EQ(shapes.size(), held.size());
    for (std::size_t i = 0; i < held.size(); ++i) {
        const Shape& shape = shapes[i];
        const Held& wanted = held[i];
        EXPECT_EQ(shape.key, wanted.key) << "in the same order";
        EXPECT_EQ(shape.version, wanted.version) << wanted.key;
        EXPECT_EQ(shape.pointsVersion, wanted.pointsVersion) << wanted.key;
        EXPECT_EQ(shape.state, wanted.state) << wanted.key;
        EXPECT_EQ(shape.metadata, wanted.metadata) << wanted.key;
        EXPECT_EQ(store.loadPoints(shape.id)->xyz, cloud(wanted.seed)) << wanted.key;
        EXPECT_EQ(shape.origin, originOf(wanted.seed)) << wanted.key;
        const auto signature = store.getSignature(shape.id);
        EXPECT_EQ(signature ? signature->bytes : "", wanted.signature) << wanted.key;
    }
}

/// One random change of a collection and of its reference.
class Changes {
  public:
    Changes(Store& store, std::int64_t collectionId, std::uint64_t seed)
        : store_(store), collectionId_(collectionId), random_(seed) {}

    const std::vector<Held>& held() const { return held_; }

    void step() {
        switch (random_.below(6)) {
            case 0:
            case 1: return add();
            case 2: return replace();
            case 3: return label();
            case 4: return remove();
            default: return work();
        }
    }

  private:
    Held* any() { return held_.empty() ? nullptr : &held_[random_.below(held_.size())]; }

    Held& of(std::int64_t shapeId) {
        const std::string key = store_.getShapeById(shapeId)->key;
        for (Held& one : held_) {
            if (one.key == key) return one;
        }
        ADD_FAILURE() << "no shape " << key;
        return held_.front();
    }

    void add() {
        Held fresh;
        fresh.key = "k" + std::to_string(next_++);
        fresh.seed = random_.below(50);
        fresh.metadata = {{"label", std::to_string(random_.below(3))}};
        ASSERT_TRUE(store_.putShape(
            request(collectionId_, fresh.key, cloud(fresh.seed), fresh.metadata, originOf(fresh.seed))));
        held_.push_back(fresh);
    }

    void replace() {
        Held* one = any();
        if (one == nullptr) return;
        one->seed += 50;
        ASSERT_TRUE(store_.putShape(
            request(collectionId_, one->key, cloud(one->seed), one->metadata, originOf(one->seed))));
        one->pointsVersion = ++one->version;
        one->state = ShapeState::kPending;
    }

    void label() {
        Held* one = any();
        if (one == nullptr) return;
        one->metadata["turn"] = std::to_string(++one->version);
        const std::int64_t id = store_.getShape(collectionId_, one->key)->id;
        ASSERT_EQ(store_.changeMetadata({id}, [&](const Shape&) { return one->metadata; })->size(), 1u);
    }

    void remove() {
        if (held_.empty()) return;
        const std::size_t at = random_.below(held_.size());
        ASSERT_TRUE(store_.deleteShape(collectionId_, held_[at].key, {}));
        held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(at));
    }

    void work() {
        const auto job = store_.claimJob().value();
        if (!job) return;
        Held& one = of(job->shapeId);
        if (random_.below(4) == 0) {
            ASSERT_TRUE(store_.failJob(*job, {ErrorCode::kNoInterior, "flat"}));
            one.state = ShapeState::kFailed;
            one.signature.clear();
            return;
        }
        const SignatureRow row = signatureFor(*job);
        ASSERT_TRUE(store_.finishJob(*job, row));
        one.state = ShapeState::kReady;
        one.signature = row.bytes;
    }

    Store& store_;
    std::int64_t collectionId_;
    Random random_;
    std::vector<Held> held_;
    int next_ = 0;
};

TEST_P(TransferTest, TenExportsOfAChangingCollectionHoldWhatItHeld) {
    const Collection beside = collection("beside");  // stays at home
    put(beside.id, "k0", 999);
    const Job its = claim();
    ASSERT_TRUE(store_->finishJob(its, signatureFor(its)));
    Changes changes(*store_, collection_.id, 5);
    std::vector<std::vector<Held>> moments;
    std::vector<std::int64_t> ids;
    std::uint64_t pending = 0;
    for (int i = 0; i < 10; ++i) {
        for (int step = 0; step < 40; ++step) changes.step();
        const std::string path = folder_.file("moment" + std::to_string(i));
        const auto exported = store_->exportCollection(collection_.id, path, {});
        ASSERT_TRUE(exported) << exported.error().message;
        const auto imported = other_->importCollection(path, as("moment" + std::to_string(i)), {});
        ASSERT_TRUE(imported) << imported.error().message;
        EXPECT_EQ(imported->description, "what they are");
        EXPECT_EQ(imported->parameters, "parameters");
        EXPECT_EQ(imported->createdAt, collection_.createdAt);
        moments.push_back(changes.held());
        ids.push_back(imported->id);
        for (const Held& one : changes.held()) pending += one.state == ShapeState::kPending ? 1 : 0;
    }
    for (int round = 0; round < 2; ++round) {
        for (std::size_t i = 0; i < moments.size(); ++i) {
            SCOPED_TRACE("moment " + std::to_string(i));
            expectHolds(*other_, ids[i], moments[i]);
        }
        EXPECT_EQ(other_->queueDepth()->jobs, pending);
        expectSoundStore(*other_);
        other_.reset();
        other_ = openOther("other.db");
        EXPECT_TRUE(other_->findings().empty()) << "no change is missing";
    }
    expectHolds(*store_, collection_.id, changes.held());
    expectSound();
}

TEST_P(TransferTest, AnExportIsADatabaseOfItsOwn) {
    const std::string path = exported();
    EXPECT_FAILS(store_->exportCollection(collection_.id, path, {}), ErrorCode::kAlreadyExists);
    EXPECT_FAILS(store_->exportCollection(777, folder_.file("x"), {}), ErrorCode::kNotFound);
    EXPECT_FALSE(std::filesystem::exists(folder_.file("x")));
    EXPECT_FALSE(std::filesystem::exists(path + "-wal"));
    EXPECT_FALSE(std::filesystem::exists(path + "-journal"));
    const auto size = std::filesystem::file_size(path);
    EXPECT_GE(store_->exportBytes(collection_.id).value(), size / 4);
    EXPECT_FAILS(store_->exportBytes(777), ErrorCode::kNotFound);
    const auto alone = openFile("parts.export");
    EXPECT_EQ(alone->listCollections()->size(), 1u);
    EXPECT_EQ(alone->countShapes(1, {}).value(), std::uint64_t{kShapes});
    EXPECT_EQ(alone->queueDepth()->jobs, std::uint64_t{kPending});
    EXPECT_EQ(alone->claimJob().value()->attempts, 1) << "the running one as if untried";
    expectSoundStore(*alone);
}

TEST_P(TransferTest, NewIdsAreInTheSameOrderAndNeverReused) {
    const std::string path = exported();
    const Shape later = put(collection_.id, "later", 500);
    ASSERT_TRUE(store_->deleteShape(collection_.id, "later", {}));
    const Collection copy = store_->importCollection(path, as("copy"), {}).value();
    EXPECT_GT(copy.id, collection_.id);
    const auto originals = store_->listShapes(collection_.id, 0, 1000, {}).value();
    const auto copies = store_->listShapes(copy.id, 0, 1000, {}).value();
    ASSERT_EQ(copies.size(), originals.size());
    EXPECT_GT(copies.front().id, later.id);
    for (std::size_t i = 0; i < copies.size(); ++i) {
        EXPECT_EQ(copies[i].key, originals[i].key);
        EXPECT_EQ(copies[i].createdAt, originals[i].createdAt);
        EXPECT_EQ(copies[i].updatedAt, originals[i].updatedAt);
        EXPECT_EQ(copies[i].failure.has_value(), originals[i].failure.has_value());
        const auto ofOriginal = store_->getSurface(originals[i].id).value();
        const auto ofCopy = store_->getSurface(copies[i].id).value();
        ASSERT_EQ(ofCopy.has_value(), ofOriginal.has_value());
        EXPECT_EQ(ofCopy ? ofCopy->bytes : "", ofOriginal ? ofOriginal->bytes : "");
        const auto its = store_->getSignature(originals[i].id);
        const auto signature = store_->getSignature(copies[i].id);
        EXPECT_EQ(signature ? signature->views : "", its ? its->views : "");
    }
    EXPECT_EQ(store_->queueDepth()->jobs, std::uint64_t{2 * kPending});
    EXPECT_EQ(store_->importCollection(path, as("again"), {})->generation, collection_.generation);
    const Job job = claim();
    EXPECT_TRUE(store_->finishJob(job, signatureFor(job)).value());
    expectSound();
}

TEST_P(TransferTest, TakesLargeScansAndAllGenerationsButTheServingOneStay) {
    const auto large = cloud(1, 800'000);
    ASSERT_TRUE(store_->putShape(request(collection_.id, "large", large)));
    put(collection_.id, "small", 2);
    finishAll();
    const Rebuild done = store_->startRebuild(collection_.id, "finer").value();
    const auto batch = store_->rebuildBatch(done.id, 0, 10).value();
    for (const Shape& shape : batch) {
        ASSERT_TRUE(store_->putRebuilt(done.id, signatureFor(shape.id, 1, 2)));
    }
    ASSERT_TRUE(store_->finishRebuild(done.id).value());
    const Rebuild running = store_->startRebuild(collection_.id, "finest").value();
    const std::int64_t small = store_->getShape(collection_.id, "small")->id;
    ASSERT_TRUE(store_->putRebuilt(running.id, signatureFor(small, 1, 3)));
    const std::string path = folder_.file("parts.export");
    ASSERT_TRUE(store_->exportCollection(collection_.id, path, {}));
    const Collection copy = other_->importCollection(path, {}, {}).value();
    EXPECT_EQ(copy.name, "parts");
    EXPECT_EQ(copy.generation, 2);
    EXPECT_EQ(copy.parameters, "finer");
    EXPECT_EQ(other_->stats()->signatures, 2u);
    EXPECT_TRUE(other_->runningRebuilds()->empty());
    EXPECT_TRUE(other_->loadPoints(other_->getShape(copy.id, "large")->id)->xyz == large);
    expectSoundStore(*other_);
}

TEST_P(TransferTest, NothingIsSeenBeforeItIsComplete) {
    const std::string path = exported();
    const std::string backup = folder_.file("meanwhile.db");
    ImportRequest request = as("copy");
    int asked = 0;
    request.accept = [&](const Collection& wanted) -> Result<void> {
        EXPECT_EQ(wanted.name, "copy");
        EXPECT_EQ(wanted.id, 0);
        return {};
    };
    request.acceptShape = [&](const Shape& shape) -> Result<void> {
        EXPECT_EQ(shape.metadata.at("n"), "1");
        ++asked;
        return {};
    };
    request.beforeVisible = [&](const Collection& hidden) -> Result<void> {
        EXPECT_EQ(hidden.name, "copy");
        EXPECT_EQ(other_->loadIndex(hidden.id, 0, 1000)->size(), std::size_t{kReady});
        EXPECT_TRUE(other_->listCollections()->empty());
        EXPECT_FALSE(other_->getCollection("copy"));
        EXPECT_EQ(other_->stats()->collections, 0u);
        EXPECT_EQ(other_->stats()->shapesReady, 0u);
        EXPECT_EQ(other_->queueDepth()->jobs, 0u);
        EXPECT_FALSE(other_->claimJob().value());
        expectSoundStore(*other_);
        return other_->backup(backup, {});
    };
    const auto imported = other_->importCollection(path, request, {});
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(asked, kShapes);
    EXPECT_EQ(other_->stats()->shapesReady, std::uint64_t{kReady});
    EXPECT_EQ(other_->queueDepth()->jobs, std::uint64_t{kPending});
    expectSoundStore(*other_);
    // Of a backup made meanwhile, the unfinished part is dropped.
    EXPECT_FAILS(other_->importCollection(backup, as("again"), {}), ErrorCode::kMalformedFile);
    ASSERT_TRUE(other_->restore(backup, {}, {}));
    EXPECT_TRUE(other_->listCollections()->empty());
    EXPECT_EQ(other_->stats()->pointBytes, 0u);
    expectNothingOf("copy");
}

TEST_P(TransferTest, OthersWriteMeanwhile) {
    const std::string path = exported();
    std::atomic<bool> stop{false};
    std::atomic<int> acknowledged{0};
    std::thread writer([&] {
        for (int i = 0; !stop; ++i) {
            if (store_->putShape(request(collection_.id, "w" + std::to_string(i), cloud(1000 + i, 500))))
                acknowledged = i + 1;
        }
    });
    for (int round = 0; round < 3; ++round) {
        const int least = acknowledged;
        const std::string moment = folder_.file("moment" + std::to_string(round));
        const auto made = store_->exportCollection(collection_.id, moment, {});
        EXPECT_TRUE(made) << made.error().message;
        const auto imported = store_->importCollection(moment, as("copy" + std::to_string(round)), {});
        EXPECT_TRUE(imported) << imported.error().message;
        if (!imported) break;
        EXPECT_GE(store_->countShapes(imported->id, {}).value(), static_cast<std::uint64_t>(kShapes + least));
    }
    const int during = acknowledged;
    stop = true;
    writer.join();
    EXPECT_GT(during, 0);
    expectSound();
}

SHAPEDB_ON_EACH_ENGINE(TransferTest);

}  // namespace
}  // namespace shapedb::store
