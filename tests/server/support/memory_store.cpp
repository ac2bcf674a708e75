#include "tests/server/support/memory_store.h"

#include <algorithm>

namespace shapedb::testing {

using namespace shapedb::store;

namespace {

tl::unexpected<Error> notFound(const std::string& what) {
    return fail(ErrorCode::kNotFound, "no such " + what);
}

bool accepts(const ShapeFilter& filter, const Shape& shape) {
    return (!filter.state || *filter.state == shape.state) && (!filter.accept || filter.accept(shape));
}

}  // namespace

Result<Collection> MemoryStore::createCollection(const std::string& name, const std::string& description,
                                                 const std::string& parameters) {
    return guarded("createCollection", [&]() -> Result<Collection> {
        for (const auto& [id, collection] : content_.collections) {
            if (collection.name == name) return fail(ErrorCode::kAlreadyExists, "collection exists");
        }
        Collection collection;
        collection.id = content_.nextId++;
        collection.name = name;
        collection.description = description;
        collection.parameters = parameters;
        return content_.collections[collection.id] = collection;
    });
}

Result<Collection> MemoryStore::getCollection(const std::string& name) {
    return guarded("getCollection", [&]() -> Result<Collection> {
        for (const auto& [id, collection] : content_.collections) {
            if (collection.name == name) return collection;
        }
        return notFound("collection");
    });
}

Result<std::vector<Collection>> MemoryStore::listCollections() {
    return guarded("listCollections", [&]() -> Result<std::vector<Collection>> {
        std::vector<Collection> all;
        for (const auto& [id, collection] : content_.collections) all.push_back(collection);
        std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
        return all;
    });
}

Result<void> MemoryStore::deleteCollection(std::int64_t collectionId) {
    return guarded("deleteCollection", [&]() -> Result<void> {
        if (content_.collections.erase(collectionId) == 0) return notFound("collection");
        std::vector<std::int64_t> ids;
        for (const auto& [id, shape] : content_.shapes) {
            if (shape.collectionId == collectionId) ids.push_back(id);
        }
        for (const std::int64_t id : ids) removeShape(id);
        for (auto rebuild = content_.rebuilds.begin(); rebuild != content_.rebuilds.end();) {
            const bool its = rebuild->second.collectionId == collectionId;
            rebuild = its ? content_.rebuilds.erase(rebuild) : std::next(rebuild);
        }
        return {};
    });
}

Shape* MemoryStore::find(std::int64_t collectionId, const std::string& key) {
    for (auto& [id, shape] : content_.shapes) {
        if (shape.collectionId == collectionId && shape.key == key) return &shape;
    }
    return nullptr;
}

void MemoryStore::queueJob(const Shape& shape) {
    for (auto job = content_.jobs.begin(); job != content_.jobs.end();) {
        const bool waiting = job->second.job.shapeId == shape.id && !job->second.running;
        job = waiting ? content_.jobs.erase(job) : std::next(job);
    }
    QueuedJob queued;
    queued.job.id = content_.nextId++;
    queued.job.shapeId = shape.id;
    queued.job.collectionId = shape.collectionId;
    queued.job.pointsVersion = shape.pointsVersion;
    queued.job.pointBytes = shape.pointCount * 12;
    content_.jobs[queued.job.id] = queued;
}

bool MemoryStore::hasJob(std::int64_t shapeId) const {
    return std::any_of(content_.jobs.begin(), content_.jobs.end(),
                       [&](const auto& entry) { return entry.second.job.shapeId == shapeId; });
}

void MemoryStore::removeShape(std::int64_t shapeId) {
    content_.shapes.erase(shapeId);
    content_.points.erase(shapeId);
    content_.signatures.erase(shapeId);
    for (auto& [id, results] : content_.rebuilt) results.erase(shapeId);
    for (auto job = content_.jobs.begin(); job != content_.jobs.end();) {
        job = job->second.job.shapeId == shapeId ? content_.jobs.erase(job) : std::next(job);
    }
}

Result<PutResult> MemoryStore::putShape(const PutRequest& request) {
    return guarded("putShape", [&]() -> Result<PutResult> {
        if (content_.collections.count(request.collectionId) == 0) return notFound("collection");
        Shape* existing = find(request.collectionId, request.key);
        if (existing == nullptr && request.mode == PutMode::kUpdateOnly) return notFound("shape");
        const std::int64_t version = existing != nullptr ? existing->version : 0;
        const bool samePoints = existing != nullptr && existing->checksum == request.scan.checksum();
        const bool same = samePoints && existing->metadata == request.metadata;
        if (request.expectedVersion && *request.expectedVersion != version) {
            return fail(ErrorCode::kVersionConflict, "version is " + std::to_string(version));
        }
        if (same) return PutResult{PutOutcome::kUnchanged, *existing};
        if (existing != nullptr && request.mode == PutMode::kInsertOnly) {
            return fail(ErrorCode::kAlreadyExists, "key is taken");
        }
        if (!samePoints && request.maxQueuedJobs != 0 && content_.jobs.size() >= request.maxQueuedJobs) {
            return fail(ErrorCode::kQueueFull, "queue is full");
        }
        if (existing == nullptr) {
            const std::int64_t id = content_.nextId++;
            existing = &content_.shapes[id];
            existing->id = id;
            existing->collectionId = request.collectionId;
            existing->key = request.key;
            existing->version = 0;
        }
        existing->version += 1;
        existing->metadata = request.metadata;
        if (samePoints) return PutResult{PutOutcome::kMetadataChanged, *existing};
        existing->pointsVersion = existing->version;
        existing->checksum = request.scan.checksum();
        existing->pointCount = request.scan.pointCount();
        existing->state = ShapeState::kPending;
        existing->failure.reset();
        content_.points[existing->id] = request.scan.points();
        queueJob(*existing);
        return PutResult{version == 0 ? PutOutcome::kCreated : PutOutcome::kReplaced, *existing};
    });
}

Result<Shape> MemoryStore::getShape(std::int64_t collectionId, const std::string& key) {
    return guarded("getShape", [&]() -> Result<Shape> {
        const Shape* shape = find(collectionId, key);
        if (shape == nullptr) return notFound("shape");
        return *shape;
    });
}

Result<Shape> MemoryStore::getShapeById(std::int64_t shapeId) {
    return guarded("getShapeById", [&]() -> Result<Shape> {
        const auto found = content_.shapes.find(shapeId);
        if (found == content_.shapes.end()) return notFound("shape");
        return found->second;
    });
}

Result<std::vector<Shape>> MemoryStore::listShapes(std::int64_t collectionId, std::int64_t afterId,
                                                   std::size_t limit, const ShapeFilter& filter) {
    return guarded("listShapes", [&] { return list(collectionId, afterId, limit, filter); });
}

Result<std::vector<Shape>> MemoryStore::list(std::int64_t collectionId, std::int64_t afterId,
                                             std::size_t limit, const ShapeFilter& filter) const {
    std::vector<Shape> page;
    for (auto at = content_.shapes.upper_bound(afterId); at != content_.shapes.end() && page.size() < limit;
         ++at) {
        if (at->second.collectionId != collectionId) continue;
        if (const auto go = filter.context.checkpoint(); !go) return fail(go.error());
        if (accepts(filter, at->second)) page.push_back(at->second);
    }
    return page;
}

Result<std::uint64_t> MemoryStore::countShapes(std::int64_t collectionId, const ShapeFilter& filter) {
    return guarded("countShapes", [&]() -> Result<std::uint64_t> {
        const auto all = list(collectionId, 0, ~std::size_t{0}, filter);
        if (!all) return fail(all.error());
        return all->size();
    });
}

Result<Shape> MemoryStore::deleteShape(std::int64_t collectionId, const std::string& key,
                                       std::optional<std::int64_t> expectedVersion) {
    return guarded("deleteShape", [&]() -> Result<Shape> {
        const Shape* found = find(collectionId, key);
        if (found == nullptr) return notFound("shape");
        if (expectedVersion && *expectedVersion != found->version) {
            return fail(ErrorCode::kVersionConflict, "version is " + std::to_string(found->version));
        }
        const Shape shape = *found;
        removeShape(shape.id);
        return shape;
    });
}

Result<std::vector<float>> MemoryStore::loadPoints(std::int64_t shapeId) {
    return guarded("loadPoints", [&]() -> Result<std::vector<float>> {
        const auto found = content_.points.find(shapeId);
        if (found == content_.points.end()) return notFound("shape");
        return found->second;
    });
}

Result<SignatureRow> MemoryStore::getSignature(std::int64_t shapeId) {
    return guarded("getSignature", [&]() -> Result<SignatureRow> {
        if (content_.shapes.count(shapeId) == 0) return notFound("shape");
        const auto found = content_.signatures.find(shapeId);
        if (found == content_.signatures.end()) return fail(ErrorCode::kNotReady, "no signature");
        return found->second;
    });
}

Result<std::optional<Job>> MemoryStore::claimJob() {
    return guarded("claimJob", [&]() -> Result<std::optional<Job>> {
        for (auto& [id, queued] : content_.jobs) {
            if (queued.running) continue;
            queued.running = true;
            ++queued.job.attempts;
            return std::optional<Job>(queued.job);
        }
        return std::optional<Job>();
    });
}

Shape* MemoryStore::settle(const Job& job) {
    content_.jobs.erase(job.id);
    const auto found = content_.shapes.find(job.shapeId);
    const bool current = found != content_.shapes.end() && found->second.pointsVersion == job.pointsVersion;
    return current ? &found->second : nullptr;
}

Result<std::optional<Shape>> MemoryStore::finishJob(const Job& job, const SignatureRow& signature) {
    return guarded("finishJob", [&]() -> Result<std::optional<Shape>> {
        Shape* shape = settle(job);
        if (shape == nullptr) return std::optional<Shape>();
        shape->state = ShapeState::kReady;
        shape->failure.reset();
        content_.signatures[shape->id] = signature;
        return std::optional<Shape>(*shape);
    });
}

Result<std::optional<Shape>> MemoryStore::failJob(const Job& job, const Error& why) {
    return guarded("failJob", [&]() -> Result<std::optional<Shape>> {
        Shape* shape = settle(job);
        if (shape == nullptr) return std::optional<Shape>();
        markFailed(*shape, why);
        return std::optional<Shape>(*shape);
    });
}

void MemoryStore::markFailed(Shape& shape, const Error& why) {
    shape.state = ShapeState::kFailed;
    shape.failure = why;
    content_.signatures.erase(shape.id);
}

Result<void> MemoryStore::releaseJob(const Job& job) {
    return guarded("releaseJob", [&]() -> Result<void> {
        const auto found = content_.jobs.find(job.id);
        if (found == content_.jobs.end()) return {};
        found->second.running = false;
        --found->second.job.attempts;
        return {};
    });
}

Result<std::vector<Shape>> MemoryStore::recoverJobs(int maxAttempts) {
    return guarded("recoverJobs", [&]() -> Result<std::vector<Shape>> {
        std::vector<Shape> quarantined;
        for (auto at = content_.jobs.begin(); at != content_.jobs.end();) {
            QueuedJob& queued = (at++)->second;
            if (!queued.running) continue;
            queued.running = false;
            if (queued.job.attempts < maxAttempts) continue;
            if (Shape* shape = settle(Job(queued.job))) {
                markFailed(*shape, {ErrorCode::kInternal, "the server died while it was segmented"});
                quarantined.push_back(*shape);
            }
        }
        return quarantined;
    });
}

Result<QueueDepth> MemoryStore::queueDepth() {
    return guarded("queueDepth", [&]() -> Result<QueueDepth> {
        QueueDepth depth;
        for (const auto& [id, queued] : content_.jobs) {
            depth.jobs += 1;
            depth.bytes += queued.job.pointBytes;
        }
        return depth;
    });
}

Result<std::vector<IndexRow>> MemoryStore::loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                     std::size_t limit) {
    return guarded("loadIndex", [&]() -> Result<std::vector<IndexRow>> {
        std::vector<IndexRow> rows;
        const auto collection = content_.collections.find(collectionId);
        if (collection == content_.collections.end()) return rows;
        for (auto at = content_.signatures.upper_bound(afterId);
             at != content_.signatures.end() && rows.size() < limit; ++at) {
            const Shape& shape = content_.shapes.at(at->first);
            if (shape.collectionId != collectionId || at->second.generation != collection->second.generation)
                continue;
            rows.push_back({shape.id, shape.metadata, at->second});
        }
        return rows;
    });
}

Result<Rebuild> MemoryStore::startRebuild(std::int64_t collectionId, const std::string& parameters) {
    return guarded("startRebuild", [&]() -> Result<Rebuild> {
        const auto collection = content_.collections.find(collectionId);
        if (collection == content_.collections.end()) return notFound("collection");
        for (const auto& [id, rebuild] : content_.rebuilds) {
            if (rebuild.collectionId == collectionId && rebuild.state == RebuildState::kRunning) {
                return fail(ErrorCode::kAlreadyExists, "a rebuild is running");
            }
        }
        Rebuild rebuild;
        rebuild.id = content_.nextId++;
        rebuild.collectionId = collectionId;
        rebuild.targetGeneration = collection->second.generation + 1;
        rebuild.parameters = parameters;
        count(rebuild);
        return content_.rebuilds[rebuild.id] = rebuild;
    });
}

void MemoryStore::count(Rebuild& rebuild) const {
    if (rebuild.state != RebuildState::kRunning) return;
    rebuild.total = rebuild.done = rebuild.failed = 0;
    const auto results = content_.rebuilt.find(rebuild.id);
    for (const auto& [id, shape] : content_.shapes) {
        if (shape.collectionId != rebuild.collectionId) continue;
        ++rebuild.total;
        if (results == content_.rebuilt.end()) continue;
        const auto result = results->second.find(id);
        if (result == results->second.end() || result->second.pointsVersion != shape.pointsVersion) continue;
        ++rebuild.done;
        if (result->second.failure) ++rebuild.failed;
    }
}

Result<Rebuild> MemoryStore::getRebuild(std::int64_t rebuildId) {
    return guarded("getRebuild", [&]() -> Result<Rebuild> {
        const auto found = content_.rebuilds.find(rebuildId);
        if (found == content_.rebuilds.end()) return notFound("rebuild");
        count(found->second);
        return found->second;
    });
}

Result<std::vector<Rebuild>> MemoryStore::runningRebuilds() {
    return guarded("runningRebuilds", [&]() -> Result<std::vector<Rebuild>> {
        std::vector<Rebuild> running;
        for (auto& [id, rebuild] : content_.rebuilds) {
            count(rebuild);
            if (rebuild.state == RebuildState::kRunning) running.push_back(rebuild);
        }
        return running;
    });
}

Result<std::vector<Shape>> MemoryStore::rebuildBatch(std::int64_t rebuildId, std::int64_t afterId,
                                                     std::size_t limit) {
    return guarded("rebuildBatch", [&]() -> Result<std::vector<Shape>> {
        const auto rebuild = content_.rebuilds.find(rebuildId);
        if (rebuild == content_.rebuilds.end()) return notFound("rebuild");
        std::vector<Shape> batch;
        const auto& results = content_.rebuilt[rebuildId];
        for (auto at = content_.shapes.upper_bound(afterId);
             at != content_.shapes.end() && batch.size() < limit; ++at) {
            const Shape& shape = at->second;
            if (shape.collectionId != rebuild->second.collectionId || hasJob(shape.id)) continue;
            const auto result = results.find(shape.id);
            if (result == results.end() || result->second.pointsVersion != shape.pointsVersion)
                batch.push_back(shape);
        }
        return batch;
    });
}

Result<void> MemoryStore::putRebuilt(std::int64_t rebuildId, const SignatureRow& signature) {
    return guarded("putRebuilt", [&]() -> Result<void> {
        content_.rebuilt[rebuildId][signature.shapeId] = {signature.pointsVersion, signature.bytes,
                                                          std::nullopt};
        return {};
    });
}

Result<void> MemoryStore::putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId,
                                            std::int64_t pointsVersion, const Error& why) {
    return guarded("putRebuildFailure", [&]() -> Result<void> {
        content_.rebuilt[rebuildId][shapeId] = {pointsVersion, "", why};
        return {};
    });
}

Result<bool> MemoryStore::finishRebuild(std::int64_t rebuildId) {
    const auto missing = rebuildBatch(rebuildId, 0, 1);
    return guarded("finishRebuild", [&]() -> Result<bool> {
        if (!missing) return fail(missing.error());
        if (!missing->empty()) return false;
        Rebuild& rebuild = content_.rebuilds.at(rebuildId);
        count(rebuild);
        rebuild.state = RebuildState::kDone;
        Collection& collection = content_.collections.at(rebuild.collectionId);
        collection.generation = rebuild.targetGeneration;
        collection.parameters = rebuild.parameters;
        for (auto& [id, shape] : content_.shapes) {
            if (shape.collectionId != rebuild.collectionId) continue;
            content_.signatures.erase(id);
            const auto result = content_.rebuilt[rebuildId].find(id);
            if (result == content_.rebuilt[rebuildId].end() || hasJob(id)) continue;
            shape.state = result->second.failure ? ShapeState::kFailed : ShapeState::kReady;
            shape.failure = result->second.failure;
            if (!shape.failure) {
                content_.signatures[id] = {id, shape.pointsVersion, collection.generation,
                                           result->second.bytes};
            }
        }
        content_.rebuilt.erase(rebuildId);
        return true;
    });
}

Result<void> MemoryStore::abandonRebuild(std::int64_t rebuildId, RebuildState state) {
    return guarded("abandonRebuild", [&]() -> Result<void> {
        const auto found = content_.rebuilds.find(rebuildId);
        if (found == content_.rebuilds.end()) return notFound("rebuild");
        found->second.state = state;
        content_.rebuilt.erase(rebuildId);
        return {};
    });
}

Result<void> MemoryStore::backup(const std::string& path, const RunContext&) {
    return guarded("backup", [&]() -> Result<void> {
        if (!backups_.emplace(path, content_).second)
            return fail(ErrorCode::kAlreadyExists, path + " is there");
        return {};
    });
}

Result<void> MemoryStore::restore(const std::string& path, const RunContext&) {
    return guarded("restore", [&]() -> Result<void> {
        const auto found = backups_.find(path);
        if (found == backups_.end()) return fail(ErrorCode::kFileNotReadable, path + " is missing");
        content_ = found->second;
        return {};
    });
}

Result<std::vector<std::string>> MemoryStore::check(const RunContext&) {
    return guarded("check", [&]() -> Result<std::vector<std::string>> { return std::vector<std::string>(); });
}

Result<StoreStats> MemoryStore::stats() {
    return guarded("stats", [&]() -> Result<StoreStats> {
        StoreStats stats;
        stats.collections = content_.collections.size();
        for (const auto& [id, shape] : content_.shapes) {
            if (shape.state == ShapeState::kPending) ++stats.shapesPending;
            if (shape.state == ShapeState::kReady) ++stats.shapesReady;
            if (shape.state == ShapeState::kFailed) ++stats.shapesFailed;
        }
        stats.signatures = content_.signatures.size();
        return stats;
    });
}

Result<void> MemoryStore::checkpoint() {
    return guarded("checkpoint", []() -> Result<void> { return {}; });
}

}  // namespace shapedb::testing
