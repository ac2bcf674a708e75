// SPDX-License-Identifier: GPL-3.0-or-later
// The store behaves like a map: seeded random operations on both with restarts in between (after
// leveldb's ModelDB).
#include <algorithm>
#include <map>
#include <set>

#include "tests/server/store/store_fixture.h"
#include "tests/support/scale.h"

namespace shapedb::store {
namespace {

struct ModelShape {
    Shape shape;
    std::uint64_t seed = 0;               ///< of its points
    std::optional<SignatureRow> serving;  ///< of the collection's generation
    std::optional<SignatureRow> rebuilt;  ///< of the running rebuild
    std::optional<Error> rebuildFailure;
    bool hasJob = false;
    bool running = false;
    int attempts = 0;
    int stops = 0;
};

class ModelTest : public StoreTest, public ::testing::WithParamInterface<std::tuple<Engine, int>> {
  protected:
    Engine engine() const override { return std::get<0>(GetParam()); }

    static constexpr int kKeys = 12;

    std::string randomKey() { return "k" + std::to_string(random_.below(kKeys)); }
    Metadata randomMetadata() {
        Metadata metadata;
        for (std::uint64_t i = random_.below(3); i > 0; --i) {
            metadata["m" + std::to_string(random_.below(3))] = std::to_string(random_.below(2));
        }
        return metadata;
    }

    void doPut() {
        const std::string key = randomKey();
        const std::uint64_t seed = random_.below(3);
        const auto points = cloud(seed);
        const Metadata metadata = randomMetadata();
        const auto result = store_->putShape(request(collection_.id, key, points, metadata));
        ASSERT_TRUE(result) << result.error().message;
        const auto found = model_.find(key);
        if (found == model_.end()) {
            EXPECT_EQ(result->outcome, PutOutcome::kCreated);
            ModelShape fresh;
            fresh.shape = result->shape;
            EXPECT_GT(fresh.shape.id, lastId_);
            lastId_ = fresh.shape.id;
            fresh.shape.key = key;
            fresh.shape.version = fresh.shape.pointsVersion = 1;
            fresh.shape.state = ShapeState::kPending;
            fresh.shape.pointCount = 8;
            fresh.shape.checksum = checksumOf(points);
            fresh.shape.metadata = metadata;
            fresh.seed = seed;
            fresh.hasJob = true;
            queue_.push_back(key);
            model_[key] = fresh;
            return;
        }
        ModelShape& model = found->second;
        if (model.seed == seed && model.shape.state == ShapeState::kFailed) {
            EXPECT_EQ(result->outcome, PutOutcome::kRetried);
            if (model.shape.metadata != metadata) ++model.shape.version;
            model.shape.metadata = metadata;
            requeue(key);
            return;
        }
        if (model.seed == seed && model.shape.metadata == metadata) {
            EXPECT_EQ(result->outcome, PutOutcome::kUnchanged);
            return;
        }
        ++model.shape.version;
        model.shape.metadata = metadata;
        if (model.seed == seed) {
            EXPECT_EQ(result->outcome, PutOutcome::kMetadataChanged);
            return;
        }
        EXPECT_EQ(result->outcome, PutOutcome::kReplaced);
        model.seed = seed;
        model.shape.pointsVersion = model.shape.version;
        model.shape.checksum = checksumOf(points);
        model.shape.state = ShapeState::kPending;
        model.shape.failure.reset();
        model.rebuilt.reset();
        model.rebuildFailure.reset();
        unqueue(key);
        requeue(key);
    }

    void requeue(const std::string& key) {
        ModelShape& model = model_[key];
        model.shape.state = ShapeState::kPending;
        model.shape.failure.reset();
        model.hasJob = true;
        model.running = false;
        model.attempts = 0;
        model.stops = 0;
        model.rebuilt.reset();
        model.rebuildFailure.reset();
        queue_.push_back(key);
    }

    void doRetry() {
        const std::string key = randomKey();
        const auto found = model_.find(key);
        const bool failed = found != model_.end() && found->second.shape.state == ShapeState::kFailed;
        const std::int64_t id = found != model_.end() ? found->second.shape.id : 200'000;
        EXPECT_EQ(store_->retryShapes({id, id + 100'000}, 0, 0).value(), failed ? 1u : 0u);
        if (failed) requeue(key);
    }

    void unqueue(const std::string& key) {
        for (auto it = queue_.begin(); it != queue_.end(); ++it) {
            if (*it == key) {
                queue_.erase(it);
                return;
            }
        }
    }

    void doDelete() {
        const std::string key = randomKey();
        const auto result = store_->deleteShape(collection_.id, key, {});
        const auto found = model_.find(key);
        ASSERT_EQ(result.has_value(), found != model_.end());
        if (!result) return;
        EXPECT_TRUE(*result == found->second.shape);
        unqueue(key);
        model_.erase(found);
    }

    /// Some shapes by id, among them ids that no shape has any more.
    std::vector<std::int64_t> randomIds() {
        std::vector<std::int64_t> ids;
        for (std::uint64_t i = random_.below(4); i > 0; --i) {
            ids.push_back(
                static_cast<std::int64_t>(1 + random_.below(static_cast<std::uint64_t>(lastId_ + 2))));
        }
        std::sort(ids.begin(), ids.end());
        ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
        return ids;
    }

    ModelShape* byId(std::int64_t id) {
        for (auto& entry : model_) {
            if (entry.second.shape.id == id) return &entry.second;
        }
        return nullptr;
    }

    void doDeleteMany() {
        const auto ids = randomIds();
        const auto isEven = [](const Shape& shape) { return shape.key.back() % 2 == 0; };
        const auto deleted = store_->deleteShapes(ids, isEven);
        ASSERT_TRUE(deleted) << deleted.error().message;
        std::size_t expected = 0;
        for (const std::int64_t id : ids) {
            const ModelShape* model = byId(id);
            if (model == nullptr || !isEven(model->shape)) continue;
            ASSERT_LT(expected, deleted->size());
            EXPECT_TRUE((*deleted)[expected++] == model->shape);
            const std::string key = model->shape.key;
            unqueue(key);
            model_.erase(key);
        }
        EXPECT_EQ(deleted->size(), expected);
    }

    void doChangeMetadata() {
        const auto ids = randomIds();
        const Metadata wanted = randomMetadata();
        const auto changed = store_->changeMetadata(ids, [&](const Shape& shape) {
            return shape.key == "k0" ? std::nullopt : std::optional<Metadata>(wanted);
        });
        ASSERT_TRUE(changed) << changed.error().message;
        std::size_t expected = 0;
        for (const std::int64_t id : ids) {
            ModelShape* model = byId(id);
            if (model == nullptr || model->shape.key == "k0" || model->shape.metadata == wanted) continue;
            model->shape.metadata = wanted;
            ++model->shape.version;
            ASSERT_LT(expected, changed->size());
            EXPECT_TRUE((*changed)[expected++] == model->shape);
        }
        EXPECT_EQ(changed->size(), expected);
    }

    void doClaim() {
        const auto job = store_->claimJob();
        ASSERT_TRUE(job) << job.error().message;
        const std::string* oldest = nullptr;
        for (const auto& key : queue_) {
            if (model_[key].running) continue;
            if (oldest == nullptr || model_[key].stops < model_[*oldest].stops) oldest = &key;
        }
        ASSERT_EQ(job->has_value(), oldest != nullptr);
        if (oldest == nullptr) return;
        ModelShape& model = model_[*oldest];
        EXPECT_EQ((*job)->shapeId, model.shape.id);
        EXPECT_EQ((*job)->pointsVersion, model.shape.pointsVersion);
        EXPECT_EQ((*job)->generation, generation_);
        model.running = true;
        EXPECT_EQ((*job)->attempts, ++model.attempts);
        claimed_.push_back(**job);
    }

    /// The model of the job's shape while the job is still its own.
    ModelShape* holder(const Job& job) {
        for (auto& entry : model_) {
            ModelShape& model = entry.second;
            if (model.shape.id == job.shapeId && model.shape.pointsVersion == job.pointsVersion &&
                model.hasJob) {
                return &model;
            }
        }
        return nullptr;
    }

    void doEndJob() {
        if (claimed_.empty()) return;
        const std::size_t at = random_.below(claimed_.size());
        const Job job = claimed_[at];
        claimed_.erase(claimed_.begin() + static_cast<std::ptrdiff_t>(at));
        ModelShape* model = holder(job);
        const std::uint64_t how = random_.below(4);
        if (how == 0) {
            ASSERT_TRUE(store_->releaseJob(job));
            if (model != nullptr) putBack(*model);
            return;
        }
        const bool counts = model != nullptr && job.generation == generation_;
        const Error why{ErrorCode::kNoInterior, "model"};
        const auto result = how == 1 ? store_->failJob(job, why) : store_->finishJob(job, signatureFor(job));
        ASSERT_TRUE(result) << result.error().message;
        ASSERT_EQ(result->has_value(), counts);
        if (!counts) {
            if (model != nullptr) putBack(*model);
            return;
        }
        model->hasJob = model->running = false;
        unqueue(model->shape.key);
        if (how == 1) {
            model->shape.state = ShapeState::kFailed;
            model->shape.failure = why;
            model->serving.reset();
            model->rebuilt.reset();
        } else {
            model->shape.state = ShapeState::kReady;
            model->serving = signatureFor(job);
        }
        EXPECT_TRUE(**result == model->shape);
    }

    static void putBack(ModelShape& model) {
        model.running = false;
        --model.attempts;
    }

    void doRebuild() {
        if (!rebuild_) {
            const auto started = store_->startRebuild(
                collection_.id, random_.below(2) == 0 ? parameters_ : "p" + std::to_string(generation_));
            ASSERT_TRUE(started) << started.error().message;
            rebuild_ = *started;
            EXPECT_EQ(rebuild_->targetGeneration, generation_ + 1);
            return;
        }
        const std::uint64_t how = random_.below(12);
        if (how == 0) {
            ASSERT_TRUE(store_->abandonRebuild(rebuild_->id, RebuildState::kCancelled));
            endRebuild();
            return;
        }
        if (how == 1) return finishRebuild();
        const auto batch = store_->rebuildBatch(rebuild_->id, 0, 1000);
        ASSERT_TRUE(batch) << batch.error().message;
        std::set<std::int64_t> expected;
        for (const auto& entry : model_) {
            const ModelShape& model = entry.second;
            if (!model.hasJob && !model.rebuilt && !model.rebuildFailure) expected.insert(model.shape.id);
        }
        std::set<std::int64_t> listed;
        for (const Shape& shape : *batch) listed.insert(shape.id);
        EXPECT_EQ(listed, expected);
        if (batch->empty()) return;
        const Shape& shape = (*batch)[random_.below(batch->size())];
        ModelShape& model = model_[shape.key];
        if (how == 2) {
            const Error why{ErrorCode::kCoplanar, "rebuilt model"};
            ASSERT_TRUE(store_->putRebuildFailure(rebuild_->id, shape.id, shape.pointsVersion, why));
            model.rebuildFailure = why;
        } else {
            model.rebuilt = signatureFor(shape.id, shape.pointsVersion, generation_ + 1);
            ASSERT_TRUE(store_->putRebuilt(rebuild_->id, *model.rebuilt));
        }
    }

    void finishRebuild() {
        bool complete = true;
        for (const auto& entry : model_) {
            const ModelShape& model = entry.second;
            complete = complete && (model.hasJob || model.rebuilt || model.rebuildFailure);
        }
        const auto finished = store_->finishRebuild(rebuild_->id);
        ASSERT_TRUE(finished) << finished.error().message;
        ASSERT_EQ(*finished, complete);
        if (!complete) return;
        ++flips_;
        ++generation_;
        const bool sameParameters = rebuild_->parameters == parameters_;
        parameters_ = rebuild_->parameters;
        for (auto& entry : model_) {
            ModelShape& model = entry.second;
            if (sameParameters && !model.hasJob && model.rebuildFailure &&
                model.shape.state == ShapeState::kReady) {
                model.serving->generation = generation_;  // the old one serves on
                continue;
            }
            model.serving = model.rebuilt;
            if (model.hasJob) continue;
            model.shape.state = model.rebuilt ? ShapeState::kReady : ShapeState::kFailed;
            model.shape.failure = model.rebuildFailure;
        }
        endRebuild();
    }

    void endRebuild() {
        rebuild_.reset();
        for (auto& entry : model_) {
            entry.second.rebuilt.reset();
            entry.second.rebuildFailure.reset();
        }
    }

    void doReopen() {
        open();
        std::vector<Crash> crashes;
        for (const auto& entry : model_) {
            if (entry.second.running && random_.below(2) == 0) {
                crashes.push_back({entry.second.shape.id, entry.second.shape.pointsVersion});
            }
        }
        const auto quarantined = store_->recoverJobs(3, crashes);
        ASSERT_TRUE(quarantined);
        std::set<std::string> expected;
        for (auto& entry : model_) {
            ModelShape& model = entry.second;
            if (!model.running) continue;
            model.running = false;
            const bool crashed = std::any_of(crashes.begin(), crashes.end(), [&](const Crash& crash) {
                return crash.shapeId == model.shape.id;
            });
            if (!crashed) {
                --model.attempts;
                ++model.stops;
            }
            if (model.attempts < 3) continue;
            model.hasJob = false;
            model.serving.reset();
            model.rebuilt.reset();
            model.shape.state = ShapeState::kFailed;
            expected.insert(entry.first);
            unqueue(entry.first);
        }
        for (const Shape& shape : *quarantined) {
            EXPECT_EQ(expected.erase(shape.key), 1u);
            model_[shape.key].shape.failure = shape.failure;
        }
        EXPECT_TRUE(expected.empty());
        claimed_.clear();
        quarantines_ += static_cast<int>(quarantined->size());
    }

    void compare() {
        const auto listed = store_->listShapes(collection_.id, 0, 1000, {}).value();
        ASSERT_EQ(listed.size(), model_.size());
        compareByKey();
        std::size_t serving = 0;
        std::map<std::int64_t, SignatureRow> index;
        const auto rows = store_->loadIndex(collection_.id, 0, 1000).value();
        for (const IndexRow& row : rows) index[row.shapeId] = row.signature;
        for (const Shape& shape : listed) {
            const ModelShape& model = model_.at(shape.key);
            EXPECT_TRUE(shape == model.shape) << shape.key;
            EXPECT_EQ(store_->loadPoints(shape.id)->xyz, cloud(model.seed));
            const auto signature = store_->getSignature(shape.id);
            ASSERT_EQ(signature.has_value(), model.serving.has_value()) << shape.key;
            if (!signature) continue;
            ++serving;
            EXPECT_EQ(signature->bytes, model.serving->bytes);
            EXPECT_EQ(signature->views, model.serving->views);
            EXPECT_EQ(index.at(shape.id).views, model.serving->views);
            EXPECT_TRUE(store_->getSurface(shape.id).value()) << "every signature came with a surface";
            EXPECT_EQ(index.at(shape.id).bytes, model.serving->bytes);
        }
        EXPECT_EQ(index.size(), serving);
        EXPECT_EQ(store_->queueDepth()->jobs, queue_.size());
        EXPECT_EQ(store_->queueDepth()->bytes, 96 * queue_.size());
        EXPECT_EQ(store_->getCollection("parts")->generation, generation_);
    }

    void compareByKey() {
        std::vector<std::string> asked;
        for (int i = 0; i <= kKeys; ++i) asked.push_back("k" + std::to_string(i));
        const auto found = store_->getShapes(collection_.id, asked).value();
        for (std::size_t i = 0; i < asked.size(); ++i) {
            const auto model = model_.find(asked[i]);
            ASSERT_EQ(found[i].has_value(), model != model_.end());
            if (found[i]) {
                EXPECT_TRUE(*found[i] == model->second.shape);
            }
        }
        ShapeFilter ones;
        ones.keyPrefix = "k1";
        auto model = model_.lower_bound("k1");
        const auto listed = store_->listShapes(collection_.id, {ShapeOrder::kKey}, 100, ones).value();
        for (const Shape& shape : listed) {
            ASSERT_NE(model, model_.end());
            EXPECT_TRUE(shape == (model++)->second.shape);
        }
        EXPECT_TRUE(model == model_.end() || model->first.rfind("k1", 0) != 0) << model->first;
    }

    Random random_{0};
    Collection collection_;
    std::int64_t generation_ = 1;
    std::string parameters_;
    std::int64_t lastId_ = 0;
    int flips_ = 0;
    int quarantines_ = 0;
    std::map<std::string, ModelShape> model_;
    std::vector<std::string> queue_;  ///< keys with a job, oldest first
    std::vector<Job> claimed_;
    std::optional<Rebuild> rebuild_;
};

TEST_P(ModelTest, BehavesLikeAMap) {
    random_ = Random(static_cast<std::uint64_t>(std::get<1>(GetParam())));
    collection_ = collection();
    parameters_ = collection_.parameters;
    for (int step = 0; step < 900 * testing::testScale() && !HasFatalFailure(); ++step) {
        const std::uint64_t dice = random_.below(100);
        SCOPED_TRACE("step " + std::to_string(step));
        if (dice < 20) {
            doPut();
        } else if (dice < 22) {
            doRetry();
        } else if (dice < 25) {
            doDelete();
        } else if (dice < 26) {
            doDeleteMany();
        } else if (dice < 29) {
            doChangeMetadata();
        } else if (dice < 50) {
            doClaim();
        } else if (dice < 70) {
            doEndJob();
        } else if (dice < 98) {
            doRebuild();
        } else {
            doReopen();
        }
        if (step % 20 == 0) compare();
        if (step % 300 == 0) expectSound();
    }
    compare();
    expectSound();
    EXPECT_GT(flips_, 0);
}

INSTANTIATE_TEST_SUITE_P(On, ModelTest,
                         ::testing::Combine(::testing::Values(Engine::kSqlite, Engine::kPostgres),
                                            ::testing::Range(1, 7)),
                         [](const auto& each) {
                             return engineName(std::get<0>(each.param)) +
                                    std::to_string(std::get<1>(each.param));
                         });

}  // namespace
}  // namespace shapedb::store
