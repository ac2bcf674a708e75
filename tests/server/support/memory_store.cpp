// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/support/memory_store.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/store/put_rules.h"
#include "server/store/quarantine.h"

namespace shapedb::testing {

using namespace shapedb::store;

namespace {

tl::unexpected<Error> notFound(const std::string& what) {
    return fail(ErrorCode::kNotFound, "no such " + what);
}

}  // namespace

TimestampMs MemoryStore::now() {
    using namespace std::chrono;
    return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

Shape* MemoryStore::find(std::int64_t collectionId, const std::string& key) {
    for (auto& [id, shape] : content_.shapes) {
        if (shape.collectionId == collectionId && shape.key == key) return &shape;
    }
    return nullptr;
}

void MemoryStore::queueJob(const Shape& shape) {
    removeJobs(shape.id);
    QueuedJob queued;
    queued.job.id = content_.nextId++;
    queued.job.shapeId = shape.id;
    queued.job.collectionId = shape.collectionId;
    queued.job.pointsVersion = shape.pointsVersion;
    queued.job.pointBytes = shape.pointCount * 12;
    content_.jobs[queued.job.id] = queued;
}

void MemoryStore::removeJobs(std::int64_t shapeId) {
    for (auto job = content_.jobs.begin(); job != content_.jobs.end();) {
        job = job->second.job.shapeId == shapeId ? content_.jobs.erase(job) : std::next(job);
    }
}

bool MemoryStore::hasJob(std::int64_t shapeId) const {
    return std::any_of(content_.jobs.begin(), content_.jobs.end(),
                       [&](const auto& entry) { return entry.second.job.shapeId == shapeId; });
}

void MemoryStore::removeShape(std::int64_t shapeId) {
    content_.shapes.erase(shapeId);
    content_.points.erase(shapeId);
    content_.signatures.erase(shapeId);
    content_.surfaces.erase(shapeId);
    for (auto& [id, results] : content_.rebuilt) results.erase(shapeId);
    removeJobs(shapeId);
}

QueueDepth MemoryStore::queueWithout(std::int64_t shapeId) const {
    QueueDepth depth;
    for (const auto& [id, queued] : content_.jobs) {
        if (queued.job.shapeId == shapeId) continue;
        depth.jobs += 1;
        depth.bytes += queued.job.pointBytes;
    }
    return depth;
}

Result<PutResult> MemoryStore::putShape(const PutRequest& request) {
    return guarded("putShape", [&]() -> Result<PutResult> {
        const auto collection = content_.collections.find(request.collectionId);
        if (collection == content_.collections.end()) return notFound("collection");
        Shape* existing = find(request.collectionId, request.key);
        const auto outcome = decidePut(request, collection->second.name, existing);
        if (!outcome) return fail(outcome.error());
        if (*outcome == PutOutcome::kUnchanged) return PutResult{*outcome, *existing};
        if (*outcome != PutOutcome::kMetadataChanged) {
            const auto room = requireRoom(request.scan.bytes(), request.maxQueuedJobs, request.maxQueuedBytes,
                                          queueWithout(existing != nullptr ? existing->id : 0));
            if (!room) return fail(room.error());
        }
        const Metadata after = request.metadata.of(existing != nullptr ? existing->metadata : Metadata());
        if (existing == nullptr) {
            const std::int64_t id = content_.nextId++;
            existing = &content_.shapes[id];
            existing->id = id;
            existing->collectionId = request.collectionId;
            existing->key = request.key;
            existing->version = 0;
            existing->createdAt = now();
        }
        if (*outcome == PutOutcome::kRetried) {
            if (existing->metadata != after) ++existing->version;
            existing->metadata = after;
            retry(*existing);
            return PutResult{*outcome, *existing};
        }
        existing->version += 1;
        existing->updatedAt = now();
        existing->metadata = after;
        if (*outcome == PutOutcome::kMetadataChanged) return PutResult{*outcome, *existing};
        existing->pointsVersion = existing->version;
        existing->checksum = request.scan.checksum();
        existing->origin = request.scan.origin();
        existing->pointCount = request.scan.pointCount();
        existing->state = ShapeState::kPending;
        existing->failure.reset();
        content_.points[existing->id] = request.scan.points();
        // What a running rebuild made of the old points.
        for (auto& [id, results] : content_.rebuilt) results.erase(existing->id);
        queueJob(*existing);
        return PutResult{*outcome, *existing};
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

Result<store::StoredPoints> MemoryStore::loadPoints(std::int64_t shapeId) {
    return guarded("loadPoints", [&]() -> Result<store::StoredPoints> {
        const auto found = content_.points.find(shapeId);
        if (found == content_.points.end()) return notFound("shape");
        return store::StoredPoints{found->second, content_.shapes.at(shapeId).origin};
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

Result<std::vector<std::optional<store::StoredHit>>> MemoryStore::getHits(
    const std::vector<std::int64_t>& shapeIds, bool withSignatures) {
    std::vector<std::optional<store::StoredHit>> hits;
    for (const std::int64_t id : shapeIds) {
        auto shape = getShapeById(id);
        if (!shape && shape.error().code != ErrorCode::kNotFound) return fail(shape.error());
        if (!shape) {
            hits.emplace_back();
            continue;
        }
        Result<SignatureRow> signature = fail(ErrorCode::kNotReady, "not asked for");
        if (withSignatures) signature = getSignature(id);
        hits.push_back(store::StoredHit{std::move(*shape), std::move(signature)});
    }
    return hits;
}

Result<std::optional<SurfaceRow>> MemoryStore::getSurface(std::int64_t shapeId) {
    return guarded("getSurface", [&]() -> Result<std::optional<SurfaceRow>> {
        if (content_.shapes.count(shapeId) == 0) return notFound("shape");
        const auto found = content_.surfaces.find(shapeId);
        if (found == content_.surfaces.end()) return std::optional<SurfaceRow>();
        return std::optional<SurfaceRow>(found->second);
    });
}

void MemoryStore::putSurface(const SignatureRow& row) {
    if (!row.surface.empty()) content_.surfaces[row.shapeId] = {row.pointsVersion, row.surface};
}

Result<std::optional<Job>> MemoryStore::claimJob() {
    return guarded("claimJob", [&]() -> Result<std::optional<Job>> {
        QueuedJob* next = nullptr;
        for (auto& [id, queued] : content_.jobs) {
            if (queued.running || (next != nullptr && next->job.stops <= queued.job.stops)) continue;
            next = &queued;
        }
        if (next == nullptr) return std::optional<Job>();
        next->running = true;
        ++next->job.attempts;
        next->job.generation = content_.collections.at(next->job.collectionId).generation;
        return std::optional<Job>(next->job);
    });
}

Result<Shape*> MemoryStore::current(const Job& job, std::int64_t generation) {
    const auto found = content_.jobs.find(job.id);
    const auto shape = content_.shapes.find(job.shapeId);
    if (found == content_.jobs.end() || shape == content_.shapes.end() ||
        shape->second.pointsVersion != job.pointsVersion) {
        return nullptr;
    }
    const std::int64_t serving = content_.collections.at(job.collectionId).generation;
    if (generation > serving) return fail(ErrorCode::kInvalidArgument, "no such generation yet");
    if (generation == serving) return &shape->second;
    release(job);
    return nullptr;
}

Result<std::optional<Shape>> MemoryStore::finishJob(const Job& job, const SignatureRow& signature) {
    return guarded("finishJob", [&]() -> Result<std::optional<Shape>> {
        if (signature.shapeId != job.shapeId || signature.pointsVersion != job.pointsVersion) {
            return fail(ErrorCode::kInvalidArgument, "the signature is of another shape or other points");
        }
        const Result<Shape*> shape = current(job, signature.generation);
        if (!shape) return fail(shape.error());
        if (*shape == nullptr) return std::optional<Shape>();
        content_.jobs.erase(job.id);
        (*shape)->state = ShapeState::kReady;
        (*shape)->failure.reset();
        (*shape)->updatedAt = now();
        content_.signatures[job.shapeId] = signature;
        putSurface(signature);
        return std::optional<Shape>(**shape);
    });
}

Result<std::optional<Shape>> MemoryStore::failJob(const Job& job, const Error& why) {
    return guarded("failJob", [&]() -> Result<std::optional<Shape>> {
        const Result<Shape*> shape = current(job, job.generation);
        if (!shape) return fail(shape.error());
        if (*shape == nullptr) return std::optional<Shape>();
        markFailed(**shape, why);
        return std::optional<Shape>(**shape);
    });
}

void MemoryStore::markFailed(Shape& shape, const Error& why) {
    shape.state = ShapeState::kFailed;
    shape.failure = why;
    shape.updatedAt = now();
    content_.signatures.erase(shape.id);
    content_.surfaces.erase(shape.id);
    for (auto& [id, results] : content_.rebuilt) {
        const auto result = results.find(shape.id);
        if (result != results.end() && !result->second.failure) results.erase(result);
    }
    removeJobs(shape.id);
}

void MemoryStore::release(const Job& job) {
    const auto found = content_.jobs.find(job.id);
    if (found == content_.jobs.end()) return;
    QueuedJob& queued = found->second;
    // A claim after a recovery has more attempts.
    if (!queued.running || queued.job.attempts != job.attempts) return;
    queued.running = false;
    --queued.job.attempts;
}

Result<void> MemoryStore::releaseJob(const Job& job) {
    return guarded("releaseJob", [&]() -> Result<void> {
        release(job);
        return {};
    });
}

Result<std::vector<Shape>> MemoryStore::recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) {
    return guarded("recoverJobs", [&]() -> Result<std::vector<Shape>> {
        std::vector<Shape> quarantined;
        for (auto at = content_.jobs.begin(); at != content_.jobs.end();) {
            QueuedJob& queued = (at++)->second;
            if (!queued.running) continue;
            queued.running = false;
            if (!crashed(crashes, queued.job.shapeId, queued.job.pointsVersion)) {
                --queued.job.attempts;
                ++queued.job.stops;
            }
            const Deaths deaths{queued.job.attempts, queued.job.stops};
            if (!isQuarantined(deaths, maxAttempts)) continue;
            Shape& shape = content_.shapes.at(queued.job.shapeId);
            markFailed(shape, quarantineError(deaths));
            quarantined.push_back(shape);
        }
        return quarantined;
    });
}

void MemoryStore::retry(Shape& shape) {
    for (auto& [id, results] : content_.rebuilt) results.erase(shape.id);
    shape.state = ShapeState::kPending;
    shape.failure.reset();
    shape.updatedAt = now();
    queueJob(shape);
}

Result<std::uint64_t> MemoryStore::retryShapes(const std::vector<std::int64_t>& shapeIds,
                                               std::uint64_t maxQueuedJobs, std::uint64_t maxQueuedBytes) {
    return guarded("retryShapes", [&]() -> Result<std::uint64_t> {
        std::uint64_t queued = 0;
        for (const std::int64_t id : shapeIds) {
            const auto found = content_.shapes.find(id);
            if (found == content_.shapes.end() || found->second.state != ShapeState::kFailed) continue;
            const std::uint64_t bytes = content_.points.at(id).size() * sizeof(float);
            const auto room = requireRoom(bytes, maxQueuedJobs, maxQueuedBytes, queueWithout(0));
            if (!room && queued == 0) return fail(room.error());
            if (!room) break;
            retry(found->second);
            ++queued;
        }
        return queued;
    });
}

Result<QueueDepth> MemoryStore::queueDepth() {
    return guarded("queueDepth", [&]() -> Result<QueueDepth> { return queueWithout(0); });
}

Result<std::vector<IndexRow>> MemoryStore::loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                     std::size_t limit) {
    return guarded("loadIndex", [&]() -> Result<std::vector<IndexRow>> {
        std::vector<IndexRow> rows;
        const auto collection = content_.collections.find(collectionId);
        if (collection == content_.collections.end()) return notFound("collection");
        for (auto at = content_.signatures.upper_bound(afterId);
             at != content_.signatures.end() && rows.size() < limit; ++at) {
            const Shape& shape = content_.shapes.at(at->first);
            if (shape.collectionId != collectionId || at->second.generation != collection->second.generation)
                continue;
            rows.push_back({shape.id, shape.key, shape.metadata, at->second});
        }
        return rows;
    });
}

Result<void> MemoryStore::backup(const std::string& path, const RunContext& context) {
    return guarded("backup", [&]() -> Result<void> {
        if (const auto go = context.checkpoint(); !go) return go;
        if (!backups_.emplace(path, content_).second)
            return fail(ErrorCode::kAlreadyExists, path + " is there");
        return {};
    });
}

Result<void> MemoryStore::restore(const std::string& path, const RunContext& context,
                                  const std::function<Result<void>()>& replacing) {
    return guarded("restore", [&]() -> Result<void> {
        if (const auto go = context.checkpoint(); !go) return go;
        const auto found = backups_.find(path);
        if (found == backups_.end()) return fail(ErrorCode::kFileNotReadable, path + " is missing");
        if (replacing) RETURN_IF_ERROR(replacing());
        // New ids continue after both histories, and jobs and rebuilds get new ones.
        const std::int64_t nextId = std::max(content_.nextId, found->second.nextId);
        content_ = found->second;
        content_.nextId = nextId;
        for (auto& [id, queued] : std::exchange(content_.jobs, {})) {
            if (queued.running) --queued.job.attempts;
            queued.running = false;
            queued.job.id = content_.nextId++;
            content_.jobs[queued.job.id] = queued;
        }
        auto results = std::exchange(content_.rebuilt, {});
        for (auto& [id, rebuild] : std::exchange(content_.rebuilds, {})) {
            rebuild.id = content_.nextId++;
            content_.rebuilds[rebuild.id] = rebuild;
            const auto its = results.find(id);
            if (its != results.end()) content_.rebuilt[rebuild.id] = std::move(its->second);
        }
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
        for (const auto& [id, results] : content_.rebuilt) {
            for (const auto& [shapeId, result] : results) stats.signatures += result.failure ? 0 : 1;
        }
        for (const auto& [id, points] : content_.points) stats.pointBytes += points.size() * sizeof(float);
        return stats;
    });
}

Result<void> MemoryStore::checkpoint() {
    return guarded("checkpoint", []() -> Result<void> { return {}; });
}

}  // namespace shapedb::testing
