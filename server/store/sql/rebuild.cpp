// SPDX-License-Identifier: GPL-3.0-or-later
// Rebuilds: a second generation of signatures is built beside the serving one.
#include "core/base/return_if_error.h"
#include "server/store/failpoints.h"
#include "server/store/parameters_codec.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql_store.h"

namespace shapedb::store {

namespace {

std::uint64_t count(Query&& query) { return static_cast<std::uint64_t>(numberOf(std::move(query))); }

/// Current counts while it runs, final ones afterwards. Throws Failure kNotFound.
Rebuild requireRebuild(Connection& connection, std::int64_t rebuildId) {
    Rebuild rebuild;
    {
        Query query(connection, sql::kRebuildById, rebuildId);
        if (!query.step())
            raise(ErrorCode::kNotFound, "there is no rebuild with id " + std::to_string(rebuildId));
        rebuild.id = query.integer(0);
        rebuild.collectionId = query.integer(1);
        rebuild.targetGeneration = query.integer(2);
        rebuild.parameters = query.text(3);
        rebuild.state = static_cast<RebuildState>(query.integer(4));
        rebuild.done = static_cast<std::uint64_t>(query.integer(5));
        rebuild.failed = static_cast<std::uint64_t>(query.integer(6));
        rebuild.total = static_cast<std::uint64_t>(query.integer(7));
        rebuild.startedAt = query.integer(8);
        rebuild.finishedAt = query.integer(9);
    }
    // Counted each time: shapes come and go while a rebuild runs.
    if (rebuild.state == RebuildState::kRunning) {
        rebuild.failed = count(Query(connection, sql::kCountRebuildFailures, rebuildId));
        rebuild.done = rebuild.failed + count(Query(connection, sql::kCountRebuilt, rebuild.collectionId,
                                                    rebuild.targetGeneration));
        rebuild.total = count(Query(connection, sql::kCountShapes, rebuild.collectionId));
    }
    return rebuild;
}

/// To be locked before the rebuild is read.
std::int64_t collectionOf(Connection& connection, std::int64_t rebuildId) {
    return numberOf(Query(connection, sql::kCollectionOfRebuild, rebuildId));
}

const char* stateName(RebuildState state) {
    switch (state) {
        case RebuildState::kRunning: return "running";
        case RebuildState::kDone: return "done";
        case RebuildState::kCancelled: return "cancelled";
        case RebuildState::kFailed: return "failed";
    }
    return "damaged";
}

Rebuild requireRunning(Connection& connection, std::int64_t rebuildId) {
    Rebuild rebuild = requireRebuild(connection, rebuildId);
    if (rebuild.state != RebuildState::kRunning) {
        raise(ErrorCode::kRejected, "rebuild " + std::to_string(rebuildId) +
                                        " is no longer running; its state is " + stateName(rebuild.state));
    }
    return rebuild;
}

void endRebuild(Connection& connection, const Rebuild& rebuild, RebuildState state, TimestampMs now) {
    Query(connection, sql::kEndRebuild, rebuild.id, static_cast<int>(state), rebuild.done, rebuild.failed,
          rebuild.total, now)
        .run();
    Query(connection, sql::kDeleteRebuildFailures, rebuild.id).run();
}

bool pointsAreCurrent(Connection& connection, const Rebuild& rebuild, std::int64_t shapeId,
                      std::int64_t pointsVersion) {
    return Query(connection, sql::kCurrentPoints, shapeId, rebuild.collectionId, pointsVersion).step();
}

}  // namespace

Result<Rebuild> SqlStore::startRebuild(std::int64_t collectionId, const std::string& parameters) {
    RETURN_IF_ERROR(requireSpace());
    return write("start the rebuild", [&](Connection& connection) {
        lockCollection(connection, collectionId);
        const Collection collection = requireCollection(connection, collectionId);
        {
            Query running(connection, sql::kRunningRebuildOf, collectionId);
            if (running.step()) {
                raise(ErrorCode::kAlreadyExists, "rebuild " + std::to_string(running.integer(0)) +
                                                     " of collection " + quoted(collection.name) +
                                                     " is running");
            }
        }
        const std::int64_t id = numberOf(Query(connection, sql::kInsertRebuild, collectionId,
                                               collection.generation + 1, parameters, now()));
        return requireRebuild(connection, id);
    });
}

Result<Rebuild> SqlStore::getRebuild(std::int64_t rebuildId) {
    return read("read the rebuild",
                [&](Connection& connection) { return requireRebuild(connection, rebuildId); });
}

Result<std::vector<Rebuild>> SqlStore::runningRebuilds() {
    return read("list the rebuilds", [&](Connection& connection) {
        std::vector<std::int64_t> ids;
        {
            Query query(connection, sql::kRunningRebuilds);
            while (query.step()) ids.push_back(query.integer(0));
        }
        std::vector<Rebuild> running;
        for (const std::int64_t id : ids) running.push_back(requireRebuild(connection, id));
        return running;
    });
}

Result<std::vector<Shape>> SqlStore::rebuildBatch(std::int64_t rebuildId, std::int64_t afterId,
                                                  std::size_t limit) {
    return read("list the shapes to rebuild", [&](Connection& connection) {
        const Rebuild rebuild = requireRunning(connection, rebuildId);
        std::vector<Shape> batch;
        if (limit == 0) return batch;
        Query query(connection, sql::kRebuildBatch, rebuild.collectionId, afterId, rebuild.targetGeneration,
                    rebuildId);
        forEachShape(query, [&](Shape&& shape) {
            batch.push_back(std::move(shape));
            return batch.size() < limit;
        });
        return batch;
    });
}

Result<void> SqlStore::putRebuilt(std::int64_t rebuildId, const SignatureRow& signature) {
    return write("store the rebuilt signature", [&](Connection& connection) {
        lockCollection(connection, collectionOf(connection, rebuildId));
        const Rebuild rebuild = requireRunning(connection, rebuildId);
        if (signature.generation != rebuild.targetGeneration) {
            raise(ErrorCode::kInvalidArgument,
                  "a signature of generation " + std::to_string(signature.generation) +
                      " for a rebuild into generation " + std::to_string(rebuild.targetGeneration));
        }
        if (!pointsAreCurrent(connection, rebuild, signature.shapeId, signature.pointsVersion)) return;
        putSignature(connection, signature);
        Query(connection, sql::kDeleteRebuildFailure, rebuildId, signature.shapeId).run();
    });
}

Result<void> SqlStore::putRebuildFailure(std::int64_t rebuildId, std::int64_t shapeId,
                                         std::int64_t pointsVersion, const Error& why) {
    return write("store the rebuild's failure", [&](Connection& connection) {
        lockCollection(connection, collectionOf(connection, rebuildId));
        const Rebuild rebuild = requireRunning(connection, rebuildId);
        if (!pointsAreCurrent(connection, rebuild, shapeId, pointsVersion)) return;
        Query(connection, sql::kPutRebuildFailure, rebuildId, shapeId, pointsVersion,
              std::string(errorCodeName(why.code)), why.message)
            .run();
        Query(connection, sql::kDeleteSignature, shapeId, rebuild.targetGeneration).run();
    });
}

Result<bool> SqlStore::finishRebuild(std::int64_t rebuildId) {
    return write("finish the rebuild", [&](Connection& connection) {
        lockCollection(connection, collectionOf(connection, rebuildId));
        const Rebuild rebuild = requireRunning(connection, rebuildId);
        const std::int64_t collectionId = rebuild.collectionId;
        const std::int64_t generation = rebuild.targetGeneration;
        // Asked again within the transaction: a shape may have come since the caller found none left.
        if (Query(connection, sql::kRebuildBatch, collectionId, 0, generation, rebuildId).step())
            return false;
        // A shape with a job stays pending: the job brings a signature of the new generation.
        Query(connection, sql::kSetReadyRebuilt, collectionId, generation, now()).run();
        SHAPEDB_FAILPOINT("switch.ready");
        const Collection collection = requireCollection(connection, collectionId);
        if (sameProfile(collection.parameters, rebuild.parameters)) {
            Query(connection, sql::kKeepOldSignatures, rebuildId, collection.generation, generation).run();
        }
        Query(connection, sql::kSetFailedRebuilt, rebuildId, now(), generation).run();
        Query(connection, sql::kSetGeneration, collectionId, generation, rebuild.parameters).run();
        SHAPEDB_FAILPOINT("switch.generation");
        Query(connection, sql::kKeepOneGeneration, collectionId, generation).run();
        SHAPEDB_FAILPOINT("switch.one_generation");
        logAll(connection, collectionId);
        endRebuild(connection, rebuild, RebuildState::kDone, now());
        return true;
    });
}

Result<void> SqlStore::abandonRebuild(std::int64_t rebuildId, RebuildState state) {
    return remove("abandon the rebuild", [&](Connection& connection) {
        if (state != RebuildState::kCancelled && state != RebuildState::kFailed) {
            raise(ErrorCode::kInvalidArgument, "a rebuild is abandoned as cancelled or as failed");
        }
        lockCollection(connection, collectionOf(connection, rebuildId));
        const Rebuild rebuild = requireRunning(connection, rebuildId);
        Query(connection, sql::kDropGeneration, rebuild.collectionId, rebuild.targetGeneration).run();
        endRebuild(connection, rebuild, state, now());
    });
}

}  // namespace shapedb::store
