// SPDX-License-Identifier: GPL-3.0-or-later
// A copy of some shards in memory that follows the database is, whatever happens, what is read anew.
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "server/cluster/replica.h"
#include "tests/server/store/store_fixture.h"
#include "tests/support/scale.h"

namespace shapedb::store {
namespace {

using cluster::ShardSet;

std::string described(const IndexRow& row) {
    std::string text = row.key + " " + std::to_string(row.signature.pointsVersion) + " " +
                       std::to_string(row.signature.generation) + " " + row.signature.bytes + " " +
                       row.signature.views;
    for (const auto& [name, value] : row.metadata) text += " " + name + "=" + value;
    return text;
}

bool isIn(const ShardSet& shards, std::int64_t shapeId) {
    return shards[static_cast<std::size_t>(cluster::shardOf(shapeId))];
}

/// Rows as text, by id.
struct PlainContent : cluster::ReplicaContent {
    using ById = std::map<std::int64_t, std::string>;
    ById begun;
    ById shown;
    int begins = 0;

    void begin(std::int64_t) override {
        begun.clear();
        ++begins;
    }
    Result<void> put(std::vector<IndexRow> rows) override {
        for (const IndexRow& row : rows) begun[row.shapeId] = described(row);
        return {};
    }
    void remove(const std::vector<std::int64_t>& shapeIds) override {
        for (const std::int64_t id : shapeIds) begun.erase(id);
    }
    void drop(const ShardSet& shards) override {
        for (auto at = begun.begin(); at != begun.end();)
            at = isIn(shards, at->first) ? begun.erase(at) : std::next(at);
    }
    Result<void> show(const ShardSet& complete, std::int64_t) override {
        shown.clear();
        for (const auto& [id, text] : begun) {
            if (isIn(complete, id)) shown[id] = text;
        }
        return {};
    }
};

struct FollowedShards {
    FollowedShards(cluster::ReplicaSource& source, std::int64_t collectionId, const ShardSet& wanted)
        : shards(wanted), replica(source, content, collectionId, 5) {
        replica.setWanted(shards);
    }
    ShardSet shards;
    PlainContent content;
    cluster::Replica replica;
};

class PostgresReplicaSourceTest : public StoreTest {
  protected:
    Engine engine() const override { return Engine::kPostgres; }
    void SetUp() override {
        StoreTest::SetUp();
        if (store_ == nullptr) return;
        source_ = replicaSource(*store_);
        id_ = collection().id;
        other_ = collection("other").id;
    }

    ShardSet someShards() {
        ShardSet shards;
        for (std::size_t shard = 0; shard < shards.size(); ++shard) shards[shard] = random_.below(2) == 0;
        return shards;
    }
    std::unique_ptr<FollowedShards> follow() {
        return std::make_unique<FollowedShards>(*source_, id_, someShards());
    }

    void finishOne() {
        const auto job = store_->claimJob().value();
        if (!job) return;
        const bool fails = random_.below(5) == 0;
        ASSERT_TRUE(fails ? store_->failJob(*job, {ErrorCode::kCoplanar, "flat"})
                          : store_->finishJob(*job, signatureFor(*job)));
    }
    void rebuildAll(const Rebuild& rebuild) {
        const auto batch = store_->rebuildBatch(rebuild.id, 0, 1'000).value();
        for (const Shape& shape : batch) {
            ASSERT_TRUE(store_->putRebuilt(
                rebuild.id, signatureFor(shape.id, shape.pointsVersion, rebuild.targetGeneration)));
        }
    }
    void switchGeneration() {
        const auto rebuild = store_->startRebuild(id_, "finer").value();
        rebuildAll(rebuild);
        ASSERT_TRUE(store_->finishRebuild(rebuild.id).value());
    }
    /// Any of the changes that there are.
    void change() {
        const std::string key = "k" + std::to_string(random_.below(60));
        const auto what = random_.below(100);
        if (what < 45) {
            put(what < 3 ? other_ : id_, key, random_.below(4),
                {{"n", std::to_string(random_.below(3))}, {"m", "x"}});
        } else if (what < 85) {
            finishOne();
        } else if (what < 99) {
            static_cast<void>(store_->deleteShape(id_, key, std::nullopt));
        } else {
            switchGeneration();
        }
    }
    void expectFollows(FollowedShards& copy) {
        for (int steps = 0;; ++steps) {
            ASSERT_LT(steps, 1'000);
            const auto more = copy.replica.step();
            ASSERT_TRUE(more) << more.error().message;
            if (!*more) break;
        }
        EXPECT_EQ(copy.replica.complete(), copy.shards);
        PlainContent::ById expected;
        const auto rows = store_->loadIndex(id_, 0, 1'000).value();
        for (const IndexRow& row : rows) {
            if (isIn(copy.shards, row.shapeId)) expected[row.shapeId] = described(row);
        }
        EXPECT_EQ(copy.content.shown, expected);
        EXPECT_EQ(copy.content.begun, expected) << "nothing of other shards is sent";
    }

    Random random_{17};
    std::unique_ptr<cluster::ReplicaSource> source_;
    std::int64_t id_ = 0;
    std::int64_t other_ = 0;
};

TEST_F(PostgresReplicaSourceTest, ACopyFollowsEveryChange) {
    std::vector<std::unique_ptr<FollowedShards>> copies;
    copies.push_back(follow());
    for (int i = 0; i < 600 * testing::testScale() && !HasFatalFailure(); ++i) {
        change();
        if (random_.below(60) == 0) copies.push_back(follow());
        const auto& copy = copies[random_.below(copies.size())];
        if (random_.below(3) == 0) {
            ASSERT_TRUE(copy->replica.step());
        }
        if (random_.below(60) == 0) {
            copy->shards = someShards();
            copy->replica.setWanted(copy->shards);
        }
        if (random_.below(60) == 0) expectFollows(*copy);
    }
    for (const auto& copy : copies) expectFollows(*copy);
    EXPECT_GT(store_->loadIndex(id_, 0, 1'000)->size(), 10u) << "the test must be about something";
}

TEST_F(PostgresReplicaSourceTest, ACopyThatIsTooFarBehindBeginsAgain) {
    for (int i = 0; i < 20; ++i) put(id_, "k" + std::to_string(i), 1);
    finishAll();
    const auto copy = follow();
    expectFollows(*copy);
    EXPECT_EQ(copy->content.begins, 1);
    for (int i = 0; i < 10; ++i) put(id_, "k" + std::to_string(i), 2, {{"n", "1"}});
    expectFollows(*copy);
    EXPECT_EQ(copy->content.begins, 1) << "nothing was forgotten";
    for (int i = 0; i < 10; ++i) put(id_, "k" + std::to_string(i), 3, {{"n", "2"}});
    // The oldest that it has not read, and one in between.
    for (const std::string place : {"min(number)", "max(number) - 2"}) {
        put(id_, "k15", 7 + place.size());
        put(id_, "k16", 7 + place.size());
        put(id_, "k17", 7 + place.size());
        put(id_, "k18", 7 + place.size());
        const int before = copy->content.begins;
        execute("DELETE FROM change WHERE collection_id = " + std::to_string(id_) + " AND number = (SELECT " +
                place + " FROM change WHERE collection_id = " + std::to_string(id_) + " AND number > " +
                std::to_string(copy->replica.number()) + ")");
        expectFollows(*copy);
        EXPECT_EQ(copy->content.begins, before + 1) << place;
    }
}

TEST_F(PostgresReplicaSourceTest, ARebuildIsSeenWhenItIsDone) {
    for (int i = 0; i < 20; ++i) put(id_, "k" + std::to_string(i), 1);
    finishAll();
    const auto copy = follow();
    expectFollows(*copy);
    const auto rebuild = store_->startRebuild(id_, "finer").value();
    rebuildAll(rebuild);
    for (int i = 0; i < 10; ++i) put(id_, "k" + std::to_string(i), 1, {{"n", "1"}});
    expectFollows(*copy);
    EXPECT_EQ(copy->content.begins, 1);
    const std::int64_t before = copy->replica.number();
    ASSERT_TRUE(store_->finishRebuild(rebuild.id).value());
    EXPECT_TRUE(source_->changes(id_, before, copy->shards, 100)->forgotten) << "all of it changed";
    expectFollows(*copy);
    EXPECT_EQ(copy->content.begins, 2);
}

TEST_F(PostgresReplicaSourceTest, ACopyFollowsARestoreAndAnImport) {
    for (int i = 0; i < 20; ++i) put(id_, "k" + std::to_string(i), 1);
    finishAll();
    const auto copy = follow();
    expectFollows(*copy);
    const std::string backup = folder_.file("backup.db");
    ASSERT_TRUE(store_->backup(backup, {}));
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(store_->deleteShape(id_, "k" + std::to_string(i), {}));
    expectFollows(*copy);
    ASSERT_TRUE(store_->restore(backup, {}, {}));
    expectFollows(*copy);
    const std::string exported = folder_.file("export.db");
    ASSERT_TRUE(store_->exportCollection(id_, exported, {}));
    ImportRequest asAnother;
    asAnother.name = "copy";
    id_ = store_->importCollection(exported, asAnother, {})->id;
    expectFollows(*follow());
}

TEST_F(PostgresReplicaSourceTest, PagesAreInOrderAndOnlyOfTheShards) {
    for (int i = 0; i < 30; ++i) put(id_, "k" + std::to_string(i), 1, {{"a", "1"}, {"b", "2"}});
    put(other_, "k", 1);
    finishAll();
    // Pages in which no shape has a signature.
    for (int i = 0; i < 30; ++i) put(id_, "pending" + std::to_string(i), 1);
    const ShardSet shards = someShards();
    const auto position = source_->rows(id_, shards, 0, 0).value();
    EXPECT_EQ(position.at.number, store_->changeLogs()->last.at(id_));
    EXPECT_EQ(position.at.generation, 1);
    EXPECT_TRUE(position.rows.empty());
    EXPECT_TRUE(source_->rows(id_, {}, 0, 10)->last);
    std::vector<std::int64_t> found;
    for (std::int64_t after = 0;;) {
        const auto page = source_->rows(id_, shards, after, 4).value();
        EXPECT_LE(page.rows.size(), 4u);
        ASSERT_GT(page.upTo, after);
        for (const IndexRow& row : page.rows) {
            EXPECT_GT(row.shapeId, after);
            EXPECT_LE(row.shapeId, page.upTo);
            EXPECT_TRUE(isIn(shards, row.shapeId));
            EXPECT_EQ(row.metadata.size(), 2u);
            found.push_back(after = row.shapeId);
        }
        after = page.upTo;
        if (page.last) break;
    }
    const auto all = source_->rows(id_, shards, 0, 1'000).value();
    EXPECT_TRUE(all.last) << "nothing is left";
    EXPECT_EQ(all.rows.size(), found.size());

    const auto some = source_->changes(id_, 0, ShardSet().set(), 7).value();
    EXPECT_EQ(some.upTo, 7);
    EXPECT_EQ(some.changed.size(), 7u);
    EXPECT_EQ(some.rows.size(), 7u) << "what they are now";
    EXPECT_TRUE(source_->changes(id_, 1'000, shards, 7)->forgotten) << "it never knew these";
    EXPECT_EQ(source_->changes(id_, position.at.number, shards, 7)->upTo, position.at.number);
}

TEST_F(PostgresReplicaSourceTest, ACollectionThatIsGoneIsNotFound) {
    EXPECT_FAILS(source_->rows(12'345, ShardSet().set(), 0, 1), ErrorCode::kNotFound);
    EXPECT_FAILS(source_->changes(12'345, 0, ShardSet().set(), 1), ErrorCode::kNotFound);
    ASSERT_TRUE(store_->deleteCollection(id_));
    EXPECT_FAILS(source_->changes(id_, 0, ShardSet().set(), 1), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace shapedb::store
