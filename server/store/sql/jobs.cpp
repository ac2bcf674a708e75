// SPDX-License-Identifier: GPL-3.0-or-later
// The job queue.
#include "server/store/failpoints.h"
#include "server/store/put_rules.h"
#include "server/store/quarantine.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql_store.h"

namespace shapedb::store {

bool SqlStore::jobIsCurrent(Connection& connection, const Job& job, std::int64_t generation) {
    std::int64_t serving = 0;
    {
        Query query(connection, sql::kCurrentJob, job.id, job.shapeId, job.pointsVersion);
        if (!query.step()) return false;
        serving = query.integer(0);
    }
    if (generation > serving) {
        raise(ErrorCode::kInvalidArgument, "a result of generation " + std::to_string(generation) +
                                               " for a collection of generation " + std::to_string(serving));
    }
    if (generation == serving) return true;
    // Made with the parameters from before a rebuild, it could never serve: queue the job again.
    Query(connection, sql::kReleaseJob, job.id, job.attempts).run();
    return false;
}

std::optional<Shape> SqlStore::markFailed(Connection& connection, std::int64_t shapeId, const Error& why) {
    Query(connection, sql::kSetFailed, shapeId, now(), std::string(errorCodeName(why.code)), why.message)
        .run();
    // Also what a running rebuild made; its next pass finds the shape again.
    Query(connection, sql::kDeleteSignatures, shapeId).run();
    Query(connection, sql::kDeleteSurface, shapeId).run();
    Query(connection, sql::kDeleteJob, shapeId).run();
    auto failed = findShapeById(connection, shapeId);
    if (failed) logChange(connection, failed->collectionId, shapeId);
    return failed;
}

Result<std::optional<Job>> SqlStore::claimJob() {
    return write("claim a job", [&](Connection& connection) {
        std::optional<Job> job;
        {
            Query query(connection, sql::kNextJob);
            if (!query.step()) return job;
            job.emplace();
            job->id = query.integer(0);
            job->shapeId = query.integer(1);
            job->collectionId = query.integer(2);
            job->pointsVersion = query.integer(3);
            job->attempts = static_cast<int>(query.integer(4)) + 1;
            job->pointBytes = static_cast<std::uint64_t>(query.integer(5));
            job->generation = query.integer(6);
            job->stops = static_cast<int>(query.integer(7));
        }
        Query(connection, sql::kStartJob, job->id).run();
        return job;
    });
}

Result<std::optional<Shape>> SqlStore::finishJob(const Job& job, const SignatureRow& signature) {
    return write("store the signature", [&](Connection& connection) -> std::optional<Shape> {
        if (signature.shapeId != job.shapeId || signature.pointsVersion != job.pointsVersion) {
            raise(ErrorCode::kInvalidArgument, "the signature is not of the job's shape and points");
        }
        lockCollectionsOf(connection, {job.shapeId});
        if (!jobIsCurrent(connection, job, signature.generation)) return std::nullopt;
        putSignature(connection, signature);
        SHAPEDB_FAILPOINT("finish.signature");
        Query(connection, sql::kSetReady, job.shapeId, now()).run();
        SHAPEDB_FAILPOINT("finish.ready");
        Query(connection, sql::kDeleteJob, job.shapeId).run();
        logChange(connection, job.collectionId, job.shapeId);
        return findShapeById(connection, job.shapeId);
    });
}

Result<std::optional<Shape>> SqlStore::failJob(const Job& job, const Error& why) {
    return write("store the failure", [&](Connection& connection) -> std::optional<Shape> {
        lockCollectionsOf(connection, {job.shapeId});
        if (!jobIsCurrent(connection, job, job.generation)) return std::nullopt;
        return markFailed(connection, job.shapeId, why);
    });
}

Result<void> SqlStore::releaseJob(const Job& job) {
    return write("put the job back", [&](Connection& connection) {
        // A claim after a recovery has more attempts: that one is not ours to put back.
        Query(connection, sql::kReleaseJob, job.id, job.attempts).run();
    });
}

Result<std::vector<Shape>> SqlStore::recoverJobs(int maxAttempts, const std::vector<Crash>& crashes) {
    return write("recover the jobs", [&](Connection& connection) {
        struct Lost {
            std::int64_t shapeId;
            Deaths deaths;
        };
        // All first, because markFailed deletes from the table that is read here.
        std::vector<Lost> lost;
        {
            Query query(connection, sql::kRunningJobs);
            while (query.step()) {
                Lost job{query.integer(0), {query.integer(2), query.integer(3)}};
                if (!crashed(crashes, job.shapeId, query.integer(1))) {
                    --job.deaths.crashes;
                    ++job.deaths.stops;
                }
                lost.push_back(job);
            }
        }
        std::vector<std::int64_t> shapeIds;
        for (const Lost& job : lost) shapeIds.push_back(job.shapeId);
        lockCollectionsOf(connection, shapeIds);
        std::vector<Shape> quarantined;
        for (const Lost& job : lost) {
            if (!isQuarantined(job.deaths, maxAttempts)) {
                Query(connection, sql::kRequeueJob, job.shapeId, job.deaths.crashes, job.deaths.stops).run();
            } else if (auto shape = markFailed(connection, job.shapeId, quarantineError(job.deaths))) {
                quarantined.push_back(std::move(*shape));
            }
        }
        return quarantined;
    });
}

void SqlStore::queueAgain(Connection& connection, std::int64_t collectionId, std::int64_t shapeId,
                          std::int64_t pointsVersion, std::uint64_t bytes) {
    Query(connection, sql::kSetPending, shapeId, now()).run();
    // A running rebuild leaves shapes with a job to the job.
    Query(connection, sql::kDeleteSignatures, shapeId).run();
    Query(connection, sql::kDeleteRebuildFailuresOfShape, shapeId).run();
    Query(connection, sql::kInsertJob, shapeId, pointsVersion, bytes, now()).run();
    logChange(connection, collectionId, shapeId);
}

Result<std::uint64_t> SqlStore::retryShapes(const std::vector<std::int64_t>& shapeIds,
                                            std::uint64_t maxQueuedJobs, std::uint64_t maxQueuedBytes) {
    return write("retry the shapes", [&](Connection& connection) {
        lockCollectionsOf(connection, shapeIds);
        std::uint64_t queued = 0;
        for (const std::int64_t shapeId : shapeIds) {
            std::int64_t pointsVersion = 0;
            std::uint64_t bytes = 0;
            std::int64_t collectionId = 0;
            {
                Query query(connection, sql::kFailedShape, shapeId);
                if (!query.step()) continue;
                pointsVersion = query.integer(0);
                bytes = static_cast<std::uint64_t>(query.integer(1));
                collectionId = query.integer(2);
            }
            const auto room = requireRoom(bytes, maxQueuedJobs, maxQueuedBytes, readTally(connection));
            if (!room && queued == 0) throw Failure(room.error());
            if (!room) break;
            queueAgain(connection, collectionId, shapeId, pointsVersion, bytes);
            ++queued;
        }
        return queued;
    });
}

Result<QueueDepth> SqlStore::queueDepth() {
    return read("read the queue depth", [](Connection& connection) { return readTally(connection); });
}

}  // namespace shapedb::store
