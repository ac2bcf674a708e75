// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/script.h"

#include <utility>

#include "core/base/random.h"

namespace shapedb::reliability {

using store::Job;
using store::PutRequest;
using store::SignatureRow;
using store::VerifiedScan;

namespace {

template <typename T>
Result<void> outcome(const Result<T>& result) {
    if (!result) return fail(result.error());
    return {};
}

/// A call of the store; what its arguments take is not part of it.
template <typename Body>
auto inStore(const Body& body) {
    const InStore inside;
    return body();
}

std::vector<float> cloud(std::uint64_t seed, std::size_t points) {
    Random random(seed);
    std::vector<float> xyz(3 * points);
    for (float& value : xyz) value = static_cast<float>(random.uniform(-1.0, 1.0));
    return xyz;
}

SignatureRow signatureFor(std::int64_t shapeId, std::int64_t pointsVersion, std::int64_t generation) {
    // Some longer than a page, so that they take several.
    const std::string id = std::to_string(shapeId) + "/" + std::to_string(pointsVersion);
    SignatureRow row;
    row.shapeId = shapeId;
    row.pointsVersion = pointsVersion;
    row.generation = generation;
    row.bytes = "signature of " + id + std::string(shapeId % 3 == 0 ? 9000 : 200, 's');
    row.surface = "surface of " + id + std::string(shapeId % 2 == 0 ? 5000 : 100, 'f');
    row.views = "views of " + id;
    return row;
}

Step put(const std::string& key, std::uint64_t seed, std::size_t points, Metadata metadata) {
    return {"put " + key, [=](World& world) -> Result<void> {
                auto scan = VerifiedScan::verify(cloud(seed, points));
                if (!scan) return fail(scan.error());
                PutRequest request(std::move(*scan));
                request.collectionId = world.memory.collectionId;
                request.key = key;
                request.metadata = store::replacedBy(metadata);
                return outcome(inStore([&] { return world.store->putShape(request); }));
            }};
}

Step remove(const std::string& key) {
    return {"delete " + key, [=](World& world) {
                return outcome(
                    inStore([&] { return world.store->deleteShape(world.memory.collectionId, key, {}); }));
            }};
}

Step claim() {
    return {"claim a job", [](World& world) {
                const auto job = inStore([&] { return world.store->claimJob(); });
                if (job && *job) world.memory.claimed.push_back(**job);
                return outcome(job);
            }};
}

Step withJob(const std::string& name, std::function<Result<void>(store::Store&, const Job&)> body) {
    return {name, [body = std::move(body)](World& world) -> Result<void> {
                if (world.memory.claimed.empty()) return fail(ErrorCode::kInternal, "no job was claimed");
                Result<void> done = body(*world.store, world.memory.claimed.back());
                if (done) world.memory.claimed.pop_back();
                return done;
            }};
}

Step finish() {
    return withJob("finish a job", [](store::Store& store, const Job& job) {
        const SignatureRow row = signatureFor(job.shapeId, job.pointsVersion, job.generation);
        return outcome(inStore([&] { return store.finishJob(job, row); }));
    });
}

Step failJob() {
    return withJob("fail a job", [](store::Store& store, const Job& job) {
        const Error why{ErrorCode::kNoInterior, "no interior of this shape"};
        return outcome(inStore([&] { return store.failJob(job, why); }));
    });
}

Step release() {
    return withJob("release a job", [](store::Store& store, const Job& job) {
        return inStore([&] { return store.releaseJob(job); });
    });
}

Step retry(const std::string& key) {
    return {"retry " + key, [=](World& world) -> Result<void> {
                const auto shape =
                    inStore([&] { return world.store->getShape(world.memory.collectionId, key); });
                if (!shape) return fail(shape.error());
                const std::vector<std::int64_t> ids = {shape->id};
                return outcome(inStore([&] { return world.store->retryShapes(ids, 0, 0); }));
            }};
}

Step startRebuild(const std::string& parameters) {
    return {"start a rebuild", [=](World& world) {
                const auto rebuild =
                    inStore([&] { return world.store->startRebuild(world.memory.collectionId, parameters); });
                if (rebuild) world.memory.rebuildId = rebuild->id;
                return outcome(rebuild);
            }};
}

Step rebuildOne(bool succeeds) {
    return {succeeds ? "rebuild a shape" : "fail to rebuild a shape", [=](World& world) -> Result<void> {
                store::Store& store = *world.store;
                const auto rebuild = store.getRebuild(world.memory.rebuildId);
                if (!rebuild) return fail(rebuild.error());
                const auto batch = store.rebuildBatch(rebuild->id, 0, 1);
                if (!batch || batch->empty()) return outcome(batch);
                const store::Shape& shape = batch->front();
                if (succeeds)
                    return store.putRebuilt(
                        rebuild->id, signatureFor(shape.id, shape.pointsVersion, rebuild->targetGeneration));
                return store.putRebuildFailure(rebuild->id, shape.id, shape.pointsVersion,
                                               {ErrorCode::kCoplanar, "flat"});
            }};
}

Step finishRebuild() {
    return {"finish a rebuild", [](World& world) -> Result<void> {
                const auto finished =
                    inStore([&] { return world.store->finishRebuild(world.memory.rebuildId); });
                if (finished && !*finished) return fail(ErrorCode::kInternal, "the rebuild is not complete");
                return outcome(finished);
            }};
}

Step abandonRebuild() {
    return {"abandon a rebuild", [](World& world) {
                return inStore([&] {
                    return world.store->abandonRebuild(world.memory.rebuildId,
                                                       store::RebuildState::kCancelled);
                });
            }};
}

Step recover() {
    return {"recover the jobs", [](World& world) {
                const auto recovered = inStore([&] { return world.store->recoverJobs(1, {}); });
                if (recovered) world.memory.claimed.clear();
                return outcome(recovered);
            }};
}

Step createCollection(const std::string& name, bool use) {
    return {"create a collection", [=](World& world) {
                const std::string text = "of the script, with more than a few bytes";
                const auto made = inStore([&] { return world.store->createCollection(name, text, text); });
                if (made && use) world.memory.collectionId = made->id;
                return outcome(made);
            }};
}

Step deleteCollection(const std::string& name) {
    return {"delete a collection", [=](World& world) -> Result<void> {
                const auto found = inStore([&] { return world.store->getCollection(name); });
                if (!found) return fail(found.error());
                return inStore([&] { return world.store->deleteCollection(found->id); });
            }};
}

Step backup(int round) {
    return {"backup",
            [=](World& world) {
                const std::string name = "backup-" + std::to_string(round) + ".db";
                const std::string path = world.folder + "/" + name;
                Result<void> done = inStore([&] { return world.store->backup(path, {}); });
                if (done) world.memory.lastBackup = name;
                return done;
            },
            true};
}

Step restore() {
    return {"restore", [](World& world) {
                const std::string path = world.folder + "/" + world.memory.lastBackup;
                Result<void> done = inStore([&] { return world.store->restore(path, {}, {}); });
                if (done) world.memory.claimed.clear();
                return done;
            }};
}

Step checkpoint() {
    return {"checkpoint", [](World& world) { return inStore([&] { return world.store->checkpoint(); }); },
            true};
}

Step reopen() {
    return {"reopen", [](World& world) { return world.open(); }, true};
}

/// A read as a step: `body` returns a Result.
template <typename Body>
Step reading(const std::string& name, Body body) {
    return {name,
            [body](World& world) {
                return outcome(inStore([&] { return body(*world.store, world.memory.collectionId); }));
            },
            true};
}

std::vector<Step> reads(const std::string& readyKey) {
    const auto ofShape = [readyKey](auto body) {
        return [readyKey, body](store::Store& store, std::int64_t id) {
            const auto shape = store.getShape(id, readyKey);
            using Value = decltype(body(store, std::int64_t{}));
            return shape ? body(store, shape->id) : Value(fail(shape.error()));
        };
    };
    return {
        reading("list",
                [](store::Store& store, std::int64_t id) { return store.listShapes(id, 0, 100, {}); }),
        reading("count", [](store::Store& store, std::int64_t id) { return store.countShapes(id, {}); }),
        reading("load the index",
                [](store::Store& store, std::int64_t id) { return store.loadIndex(id, 0, 100); }),
        reading("list collections",
                [](store::Store& store, std::int64_t) { return store.listCollections(); }),
        reading("queue depth", [](store::Store& store, std::int64_t) { return store.queueDepth(); }),
        reading("statistics", [](store::Store& store, std::int64_t) { return store.stats(); }),
        reading("rebuilds", [](store::Store& store, std::int64_t) { return store.runningRebuilds(); }),
        reading("check", [](store::Store& store, std::int64_t) { return store.check({}); }),
        reading("points", ofShape([](store::Store& store, std::int64_t id) { return store.loadPoints(id); })),
        reading("signature",
                ofShape([](store::Store& store, std::int64_t id) { return store.getSignature(id); })),
        reading("surface",
                ofShape([](store::Store& store, std::int64_t id) { return store.getSurface(id); })),
    };
}

}  // namespace

Result<void> World::open() {
    store.reset();
    store::SqliteOptions options;
    options.path = path();
    options.readers = 1;
    options.busyTimeoutMs = 0;  // nobody else is there: a lock in the way is a fault
    options.now = [this] { return clock; };
    auto opened = inStore([&] { return store::openSqliteStore(options); });
    if (!opened) return fail(opened.error());
    store = std::move(*opened);
    return {};
}

std::vector<Step> storeScript(int round) {
    const std::string suffix = "-" + std::to_string(round);
    const auto seed = [round](int i) { return static_cast<std::uint64_t>(100 * round + i); };
    std::vector<Step> steps = {
        createCollection("parts" + suffix, true),
        put("a", seed(1), 300, {}),
        put("b", seed(2), 8, {{"label", "b"}, {"n", "2"}}),
        put("c", seed(3), 2000, {{"label", "c"}}),
        put("d", seed(4), 40, {}),
        claim(),
        finish(),
        claim(),
        failJob(),
        claim(),
        release(),
        put("a", seed(5), 500, {{"replaced", "yes"}}),
        put("b", seed(2), 8, {{"label", "another"}}),
        remove("c"),
        claim(),
        failJob(),
        retry("d"),
        claim(),
        finish(),
        claim(),
        finish(),
        claim(),
        finish(),
        put("b", seed(2), 8, {{"label", "metadata alone"}}),
        startRebuild("p" + suffix),
        rebuildOne(true),
        put("e", seed(6), 100, {{"during", "a rebuild"}}),
        rebuildOne(false),
        claim(),
        finish(),
        rebuildOne(true),
        rebuildOne(true),
        finishRebuild(),
        backup(round),
        checkpoint(),
        startRebuild("q"),
        rebuildOne(true),
        abandonRebuild(),
        put("f", seed(7), 60, {}),
        claim(),
        reopen(),
        recover(),
        restore(),
        createCollection("gone" + suffix, false),
        put("g", seed(8), 700, {{"after", "the restore"}}),
        claim(),
        finish(),
        deleteCollection("gone" + suffix),
    };
    for (Step& read : reads("e")) steps.push_back(std::move(read));
    if (round > 0) steps.push_back(deleteCollection("parts-" + std::to_string(round - 1)));
    return steps;
}

}  // namespace shapedb::reliability
