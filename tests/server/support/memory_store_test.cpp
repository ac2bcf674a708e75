// SPDX-License-Identifier: GPL-3.0-or-later
// The memory store answers as SQLite does: what tests on it show holds for the server.
#include "tests/server/support/memory_store.h"

#include <sstream>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {
namespace {

/// Ids differ between the stores; keys and names do not.
std::string textOf(const Shape& shape) {
    std::ostringstream text;
    text << shape.key << " version " << shape.version << " points " << shape.pointsVersion << " state "
         << static_cast<int>(shape.state) << " count " << shape.pointCount << " metadata";
    for (const auto& [name, value] : shape.metadata) text << ' ' << name << '=' << value;
    if (shape.failure) text << " failure " << errorCodeName(shape.failure->code);
    return text.str();
}
std::string textOf(const PutResult& put) {
    return std::to_string(static_cast<int>(put.outcome)) + ": " + textOf(put.shape);
}
std::string textOf(const Rebuild& rebuild) {
    std::ostringstream text;
    text << "into " << rebuild.targetGeneration << " by " << rebuild.parameters << " state "
         << static_cast<int>(rebuild.state) << ": " << rebuild.done << ", " << rebuild.failed << " of "
         << rebuild.total;
    return text.str();
}
std::string textOf(const Job& job) {
    std::ostringstream text;
    text << "points " << job.pointsVersion << " generation " << job.generation << " attempts " << job.attempts
         << " bytes " << job.pointBytes;
    return text.str();
}
std::string textOf(const QueueDepth& depth) {
    return std::to_string(depth.jobs) + " jobs, " + std::to_string(depth.bytes) + " bytes";
}
std::string textOf(const SignatureRow& row) {
    return std::to_string(row.pointsVersion) + "/" + std::to_string(row.generation) + " " + row.bytes;
}
std::string textOf(const IndexRow& row) { return textOf(row.signature); }
std::string textOf(bool value) { return value ? "true" : "false"; }

template <typename T>
std::string textOf(const std::optional<T>& value) {
    return value ? textOf(*value) : "none";
}
template <typename T>
std::string textOf(const std::vector<T>& values) {
    std::string text;
    for (const T& value : values) text += textOf(value) + "\n";
    return text;
}
template <typename T>
std::string textOf(const Result<T>& result) {
    return result ? textOf(*result) : errorCodeName(result.error().code);
}
std::string textOf(const Result<void>& result) {
    return result ? "done" : errorCodeName(result.error().code);
}

/// One store and what a process that works on it holds.
struct Side {
    explicit Side(Store& its) : store(its) {}

    Store& store;
    std::int64_t collection = 0;
    std::vector<Job> jobs;
    std::vector<Rebuild> rebuilds;

    std::int64_t idOf(const std::string& key) {
        const auto shape = store.getShape(collection, key);
        return shape ? shape->id : -1;
    }
};

std::string put(Side& side, Random random) {
    const std::string key = "k" + std::to_string(random.below(4));
    PutRequest put =
        request(side.collection, key, cloud(random.below(3)), {{"n", random.below(2) ? "1" : "2"}});
    put.mode = static_cast<PutMode>(random.below(4));
    put.metadata.replaceAll = random.below(2) == 0;
    if (!put.metadata.replaceAll && random.below(2) == 0) put.metadata = {{}, {"n"}, false};
    if (random.below(3) == 0) put.expectedVersion = static_cast<std::int64_t>(random.below(4));
    if (random.below(3) == 0) put.maxQueuedJobs = 2;
    if (random.below(3) == 0) put.maxQueuedBytes = 2 * put.scan.bytes();
    return textOf(side.store.putShape(put));
}

std::string work(Side& side, Random random) {
    const std::uint64_t what = random.below(7);
    if (what == 0 || side.jobs.empty()) {
        const auto job = side.store.claimJob();
        if (job && *job) side.jobs.push_back(**job);
        return textOf(job);
    }
    // Also jobs that were settled or put back long ago.
    const Job job = side.jobs[random.below(side.jobs.size())];
    SignatureRow row{job.shapeId, job.pointsVersion, job.generation, "made " + textOf(job)};
    if (random.below(8) == 0) row.generation += 1;
    if (random.below(8) == 0) row.pointsVersion += 1;
    switch (what) {
        case 1:
        case 2: return textOf(side.store.finishJob(job, row));
        case 3: return textOf(side.store.failJob(job, {ErrorCode::kNoInterior, "hollow"}));
        case 4: return textOf(side.store.releaseJob(job));
        case 5:
            return textOf(side.store.retryShapes(
                {job.shapeId, side.idOf("k0"), side.idOf("k1"), side.idOf("k2")}, random.below(4), 0));
        default:
            return textOf(side.store.recoverJobs(2, random.below(2) == 0
                                                        ? std::vector<Crash>{{job.shapeId, job.pointsVersion}}
                                                        : std::vector<Crash>{}));
    }
}

std::string rebuild(Side& side, Random random) {
    const std::uint64_t what = random.below(7);
    if (what == 0 || side.rebuilds.empty()) {
        const auto started =
            side.store.startRebuild(side.collection, "parameters " + std::to_string(random.below(9)));
        if (started) side.rebuilds.push_back(*started);
        return textOf(started);
    }
    // The latest more often than those that are over.
    const bool latest = random.below(4) > 0;
    const Rebuild rebuild = latest ? side.rebuilds.back() : side.rebuilds[random.below(side.rebuilds.size())];
    const std::string key = "k" + std::to_string(random.below(4));
    const auto pointsVersion = static_cast<std::int64_t>(1 + random.below(6));
    switch (what) {
        case 1: return textOf(side.store.finishRebuild(rebuild.id));
        case 2:
            return random.below(4) > 0 ? textOf(side.store.getRebuild(rebuild.id))
                                       : textOf(side.store.abandonRebuild(
                                             rebuild.id, static_cast<RebuildState>(random.below(4))));
        case 3:
            return textOf(side.store.putRebuildFailure(rebuild.id, side.idOf(key), pointsVersion,
                                                       {ErrorCode::kCoplanar, "flat"}));
        case 4:
            return textOf(side.store.putRebuilt(
                rebuild.id, {side.idOf(key), pointsVersion, rebuild.targetGeneration, "rebuilt " + key}));
        default: {
            // All that are missing.
            const auto batch = side.store.rebuildBatch(rebuild.id, 0, 100);
            if (!batch) return textOf(batch);
            for (const Shape& shape : *batch) {
                EXPECT_TRUE(side.store.putRebuilt(
                    rebuild.id,
                    {shape.id, shape.pointsVersion, rebuild.targetGeneration, "all " + shape.key}));
            }
            return textOf(batch);
        }
    }
}

/// Some shapes by their keys; one of them need not be there.
std::vector<std::int64_t> idsOf(Side& side, Random& random) {
    std::vector<std::int64_t> ids;
    for (const std::string key : {"k0", "k1", "k2", "k3"}) {
        if (random.below(2) == 0) ids.push_back(side.idOf(key));
    }
    return ids;
}

std::string many(Side& side, Random random) {
    const auto ids = idsOf(side, random);
    const std::string value = random.below(2) ? "1" : "2";
    if (random.below(3) > 0) {
        return textOf(side.store.changeMetadata(ids, [&](const Shape& shape) {
            return shape.key == "k2" ? std::nullopt : std::optional<Metadata>(Metadata{{"n", value}});
        }));
    }
    return textOf(side.store.deleteShapes(ids, [&](const Shape& shape) {
        return shape.metadata.count("n") > 0 && shape.metadata.at("n") == value;
    }));
}

std::string collections(Side& side, Random random) {
    const std::string name = "n" + std::to_string(random.below(3));
    switch (random.below(3)) {
        case 0: {
            const auto renamed = side.store.renameCollection(side.collection, name);
            return renamed ? renamed->name : errorCodeName(renamed.error().code);
        }
        case 1: return textOf(side.store.setAlias(name, side.collection + (random.below(4) == 0 ? 1000 : 0)));
        default: return textOf(side.store.deleteAlias(name));
    }
}

std::string step(Side& side, Random random) {
    switch (random.below(10)) {
        case 8: return "many " + many(side, random);
        case 9: return "collections " + collections(side, random);
        case 0:
        case 1:
        case 2: return "put " + put(side, random);
        case 3:
        case 4: return "work " + work(side, random);
        case 5:
        case 6: return "rebuild " + rebuild(side, random);
        default: break;
    }
    const std::string key = "k" + std::to_string(random.below(4));
    std::optional<std::int64_t> expected;
    if (random.below(2) == 0) expected = static_cast<std::int64_t>(1 + random.below(4));
    return "delete " + textOf(side.store.deleteShape(side.collection, key, expected));
}

/// Everything that can be read.
std::string stateOf(Side& side) {
    std::string text =
        textOf(side.store.listShapes(side.collection, 0, 100, {})) + textOf(side.store.queueDepth()) + "\n" +
        textOf(side.store.loadIndex(side.collection, 0, 100)) + textOf(side.store.runningRebuilds());
    for (const std::string key : {"k0", "k1", "k2", "k3"}) {
        text += textOf(side.store.getSignature(side.idOf(key))) + "\n";
    }
    for (const bool withSignatures : {false, true}) {
        const auto hits = side.store.getHits({side.idOf("k1"), 1'000'000, side.idOf("k0")}, withSignatures);
        for (const auto& hit : hits.value())
            text += hit ? textOf(hit->shape) + textOf(hit->signature) + "\n" : "gone\n";
    }
    ShapeFilter k;
    k.keyPrefix = "k";
    text += textOf(side.store.listShapes(side.collection, {ShapeOrder::kKey, true}, 3, k));
    const auto aliases = side.store.listAliases().value();
    for (const Alias& alias : aliases) text += alias.name + " ";
    const auto collections = side.store.listCollections().value();
    for (const Collection& one : collections) text += one.name + " ";
    const auto stats = side.store.stats();
    return text + std::to_string(stats->signatures) + " signatures, " + std::to_string(stats->pointBytes) +
           " bytes of points";
}

using MemoryStoreTest = StoreTest;

TEST_F(MemoryStoreTest, AnswersAsSqliteDoes) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        testing::MemoryStore memory;
        Side a(*store_);
        Side b(memory);
        for (Side* side : {&a, &b}) {
            ASSERT_TRUE(side->store.createCollection("n2", "", "p"));
            side->collection = side->store.createCollection("c" + std::to_string(seed), "", "p").value().id;
        }
        Random random(seed);
        for (int i = 0; i < 150; ++i) {
            const Random choices(random.next());  // the same for both
            const std::string done = step(a, choices);
            ASSERT_EQ(done, step(b, choices)) << "seed " << seed << ", step " << i;
            ASSERT_EQ(stateOf(a), stateOf(b)) << "seed " << seed << ", step " << i << ": " << done;
        }
        expectSound();
        const auto collections = store_->listCollections().value();
        for (const Collection& one : collections) {
            ASSERT_TRUE(store_->deleteCollection(one.id));
        }
        EXPECT_TRUE(store_->listAliases()->empty());
    }
}

TEST_F(MemoryStoreTest, RestoresAsSqliteDoes) {
    testing::MemoryStore memory;
    Side a(*store_);
    Side b(memory);
    for (Side* side : {&a, &b}) {
        Store& store = side->store;
        side->collection = store.createCollection("parts", "", "p").value().id;
        ASSERT_TRUE(store.putShape(request(side->collection, "k0", cloud(1))));
        const Job running = **store.claimJob();
        const Rebuild rebuild = store.startRebuild(side->collection, "q").value();
        const std::string backup = folder_.file("backup");
        ASSERT_TRUE(store.backup(backup, {}));
        EXPECT_FAILS(store.backup(backup, {}), ErrorCode::kAlreadyExists);
        const Shape later = store.putShape(request(side->collection, "k1", cloud(2)))->shape;
        ASSERT_TRUE(store.restore(backup, {}, {}));
        // Results for the old content are dropped.
        EXPECT_FALSE(store.finishJob(running, signatureFor(running)).value());
        EXPECT_FAILS(store.getRebuild(rebuild.id), ErrorCode::kNotFound);
        EXPECT_EQ(store.runningRebuilds()->size(), 1u);
        const Job again = **store.claimJob();
        EXPECT_NE(again.id, running.id);
        EXPECT_EQ(again.attempts, 1) << "as if untried";
        EXPECT_GT(store.putShape(request(side->collection, "k2", cloud(3)))->shape.id, later.id);
    }
    EXPECT_EQ(stateOf(a), stateOf(b));
    EXPECT_FAILS(memory.restore("unknown", {}, {}), ErrorCode::kFileNotReadable);
}

TEST_F(MemoryStoreTest, ImportsAsSqliteDoes) {
    testing::MemoryStore memory;
    Side a(*store_);
    Side b(memory);
    for (Side* side : {&a, &b}) {
        Store& store = side->store;
        const std::int64_t original = store.createCollection("parts", "", "p").value().id;
        ASSERT_TRUE(store.putShape(request(original, "k0", cloud(1))));
        const Job job = **store.claimJob();
        ASSERT_TRUE(store.finishJob(job, {job.shapeId, 1, 1, "its signature", "its surface"}));
        ASSERT_TRUE(store.putShape(request(original, "k1", cloud(2), {{"m", "1"}})));
        const std::string file = folder_.file("export");
        ASSERT_TRUE(store.exportCollection(original, file, {}));
        EXPECT_FAILS(store.exportCollection(original, file, {}), ErrorCode::kAlreadyExists);
        EXPECT_FAILS(store.exportCollection(777, folder_.file("no"), {}), ErrorCode::kNotFound);
        ImportRequest import;
        EXPECT_FAILS(store.importCollection(file, import, {}), ErrorCode::kAlreadyExists);
        import.name = "copy";
        side->collection = store.importCollection(file, import, {})->id;
        EXPECT_GT(side->collection, original);
        EXPECT_FAILS(store.importCollection("unknown", import, {}), ErrorCode::kFileNotReadable);
    }
    EXPECT_EQ(stateOf(a), stateOf(b));
}

}  // namespace
}  // namespace shapedb::store
