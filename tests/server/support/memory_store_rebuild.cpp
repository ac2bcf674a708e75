// SPDX-License-Identifier: GPL-3.0-or-later
// Rebuilds in the memory store.
#include "server/store/parameters_codec.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::testing {

using namespace shapedb::store;

Result<Rebuild*> MemoryStore::running(std::int64_t rebuildId) {
    const auto found = content_.rebuilds.find(rebuildId);
    if (found == content_.rebuilds.end()) return fail(ErrorCode::kNotFound, "no such rebuild");
    if (found->second.state != RebuildState::kRunning) {
        return fail(ErrorCode::kRejected, "the rebuild is not running");
    }
    return &found->second;
}

void MemoryStore::count(Rebuild& rebuild) const {
    if (rebuild.state != RebuildState::kRunning) return;
    rebuild.total = rebuild.done = rebuild.failed = 0;
    for (const auto& [id, shape] : content_.shapes) {
        if (shape.collectionId == rebuild.collectionId) ++rebuild.total;
    }
    const auto results = content_.rebuilt.find(rebuild.id);
    if (results == content_.rebuilt.end()) return;
    for (const auto& [id, result] : results->second) {
        ++rebuild.done;
        if (result.failure) ++rebuild.failed;
    }
}

std::vector<Shape> MemoryStore::missing(const Rebuild& rebuild, std::int64_t afterId,
                                        std::size_t limit) const {
    std::vector<Shape> batch;
    const auto results = content_.rebuilt.find(rebuild.id);
    for (auto at = content_.shapes.upper_bound(afterId); at != content_.shapes.end() && batch.size() < limit;
         ++at) {
        const auto& [id, shape] = *at;
        if (shape.collectionId != rebuild.collectionId || hasJob(id)) continue;
        if (results == content_.rebuilt.end() || results->second.count(id) == 0) batch.push_back(shape);
    }
    return batch;
}

/// Drops what is of a deleted shape, or of points that were replaced.
void MemoryStore::put(const Rebuild& rebuild, std::int64_t shapeId, Rebuilt result) {
    const auto shape = content_.shapes.find(shapeId);
    if (shape == content_.shapes.end() || shape->second.collectionId != rebuild.collectionId) return;
    if (shape->second.pointsVersion != result.pointsVersion) return;
    content_.rebuilt[rebuild.id][shapeId] = std::move(result);
}

void MemoryStore::end(Rebuild& rebuild, RebuildState state) {
    count(rebuild);
    rebuild.state = state;
    rebuild.finishedAt = now();
    content_.rebuilt.erase(rebuild.id);
}

Result<Rebuild> MemoryStore::startRebuild(std::int64_t collectionId, const std::string& parameters) {
    return guarded("startRebuild", [&]() -> Result<Rebuild> {
        const auto collection = content_.collections.find(collectionId);
        if (collection == content_.collections.end()) {
            return fail(ErrorCode::kNotFound, "no such collection");
        }
        for (const auto& [id, rebuild] : content_.rebuilds) {
            if (rebuild.collectionId == collectionId && rebuild.state == RebuildState::kRunning) {
                return fail(ErrorCode::kAlreadyExists, "rebuild " + std::to_string(id) + " is running");
            }
        }
        Rebuild rebuild;
        rebuild.id = content_.nextId++;
        rebuild.collectionId = collectionId;
        rebuild.targetGeneration = collection->second.generation + 1;
        rebuild.parameters = parameters;
        rebuild.startedAt = now();
        count(rebuild);
        return content_.rebuilds[rebuild.id] = rebuild;
    });
}

Result<Rebuild> MemoryStore::getRebuild(std::int64_t rebuildId) {
    return guarded("getRebuild", [&]() -> Result<Rebuild> {
        const auto found = content_.rebuilds.find(rebuildId);
        if (found == content_.rebuilds.end()) return fail(ErrorCode::kNotFound, "no such rebuild");
        count(found->second);
        return found->second;
    });
}

Result<std::vector<Rebuild>> MemoryStore::runningRebuilds() {
    return guarded("runningRebuilds", [&]() -> Result<std::vector<Rebuild>> {
        std::vector<Rebuild> all;
        for (auto& [id, rebuild] : content_.rebuilds) {
            count(rebuild);
            if (rebuild.state == RebuildState::kRunning) all.push_back(rebuild);
        }
        return all;
    });
}

Result<std::vector<Shape>> MemoryStore::rebuildBatch(std::int64_t rebuildId, std::int64_t afterId,
                                                     std::size_t limit) {
    return guarded("rebuildBatch", [&]() -> Result<std::vector<Shape>> {
        const auto rebuild = running(rebuildId);
        if (!rebuild) return fail(rebuild.error());
        return missing(**rebuild, afterId, limit);
    });
}

Result<void> MemoryStore::putRebuilt(std::int64_t rebuildId, const SignatureRow& signature) {
    return guarded("putRebuilt", [&]() -> Result<void> {
        const auto rebuild = running(rebuildId);
        if (!rebuild) return fail(rebuild.error());
        if (signature.generation != (*rebuild)->targetGeneration) {
            return fail(ErrorCode::kInvalidArgument, "a signature of another generation");
        }
        put(**rebuild, signature.shapeId, {signature.pointsVersion, signature.bytes, std::nullopt});
        const auto shape = content_.shapes.find(signature.shapeId);
        if (shape != content_.shapes.end() && shape->second.pointsVersion == signature.pointsVersion) {
            putSurface(signature);
        }
        return {};
    });
}

Result<void> MemoryStore::putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId,
                                            std::int64_t pointsVersion, const Error& why) {
    return guarded("putRebuildFailure", [&]() -> Result<void> {
        const auto rebuild = running(rebuildId);
        if (!rebuild) return fail(rebuild.error());
        put(**rebuild, shapeId, {pointsVersion, "", why});
        return {};
    });
}

Result<bool> MemoryStore::finishRebuild(std::int64_t rebuildId) {
    return guarded("finishRebuild", [&]() -> Result<bool> {
        const auto found = running(rebuildId);
        if (!found) return fail(found.error());
        Rebuild& rebuild = **found;
        if (!missing(rebuild, 0, 1).empty()) return false;
        Collection& collection = content_.collections.at(rebuild.collectionId);
        const bool comparable = sameProfile(collection.parameters, rebuild.parameters);
        const std::int64_t before = collection.generation;
        collection.generation = rebuild.targetGeneration;
        collection.parameters = rebuild.parameters;
        const auto results = content_.rebuilt[rebuildId];
        end(rebuild, RebuildState::kDone);
        for (auto& [id, shape] : content_.shapes) {
            if (shape.collectionId != rebuild.collectionId) continue;
            const auto old = content_.signatures.find(id);
            const bool serves = old != content_.signatures.end() && old->second.generation == before;
            if (!hasJob(id) && comparable && serves && shape.state == ShapeState::kReady &&
                results.at(id).failure) {
                old->second.generation = collection.generation;
                continue;
            }
            content_.signatures.erase(id);
            if (hasJob(id)) continue;
            const Rebuilt& result = results.at(id);
            shape.state = result.failure ? ShapeState::kFailed : ShapeState::kReady;
            shape.failure = result.failure;
            if (!shape.failure) {
                content_.signatures[id] = {id, shape.pointsVersion, collection.generation, result.bytes, {}};
            }
        }
        return true;
    });
}

Result<void> MemoryStore::abandonRebuild(std::int64_t rebuildId, RebuildState state) {
    return guarded("abandonRebuild", [&]() -> Result<void> {
        if (state != RebuildState::kCancelled && state != RebuildState::kFailed) {
            return fail(ErrorCode::kInvalidArgument, "abandoned as cancelled or as failed");
        }
        const auto rebuild = running(rebuildId);
        if (!rebuild) return fail(rebuild.error());
        end(**rebuild, state);
        return {};
    });
}

}  // namespace shapedb::testing
