#include "server/rpc/admin_service.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/base/return_if_error.h"
#include "server/config/load.h"
#include "server/rpc/backup_stream.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/limits.h"
#include "server/rpc/request_checks.h"
#include "server/rpc/temporary_file.h"

namespace shapedb::rpc {
namespace {

using RebuildWriter = grpc::ServerWriter<v1::RebuildProgress>;

bool hasParameters(const v1::RebuildRequest& request) {
    return request.has_segmentation() || request.has_signature() ||
           request.profile() != v1::PROFILE_UNSPECIFIED;
}

/// Reads the stored signatures anew; nothing is segmented.
Result<void> reloadCache(const Services& services, Call& call,
                         const std::vector<index::SnapshotPtr>& collections, RebuildWriter& writer) {
    for (const index::SnapshotPtr& snapshot : collections) {
        const auto began = std::chrono::steady_clock::now();
        RETURN_IF_ERROR(services.index.reload(snapshot->collection.id));
        const auto now = services.index.byId(snapshot->collection.id);
        const std::uint64_t count = now ? (*now)->signatures.size() : 0;
        v1::RebuildProgress progress;
        progress.set_collection(snapshot->collection.name);
        progress.set_done(count);
        progress.set_total(count);
        progress.set_finished(true);
        progress.set_seconds(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
        RETURN_IF_ERROR(call.write(writer, progress));
    }
    return {};
}

Result<void> sendProgress(Call& call, const std::string& collection, const store::Rebuild& rebuild,
                          RebuildWriter& writer) {
    using std::chrono::system_clock;
    const auto nowMs =
        std::chrono::duration_cast<std::chrono::milliseconds>(system_clock::now().time_since_epoch());
    const store::TimestampMs end = rebuild.finishedAt != 0 ? rebuild.finishedAt : nowMs.count();
    v1::RebuildProgress progress;
    progress.set_collection(collection);
    progress.set_done(rebuild.done);
    progress.set_total(rebuild.total);
    progress.set_failed(rebuild.failed);
    progress.set_finished(rebuild.state == store::RebuildState::kDone);
    progress.set_seconds(static_cast<double>(std::max<store::TimestampMs>(0, end - rebuild.startedAt)) /
                         1'000.0);
    return call.write(writer, progress);
}

/// Tells how a rebuild goes until it ends; it goes on whatever happens to this call.
Result<void> follow(const Services& services, Call& call, const std::string& collection,
                    store::Rebuild rebuild, bool detach, RebuildWriter& writer) {
    RunContext oneSecond = call.run();
    for (;;) {
        RETURN_IF_ERROR(sendProgress(call, collection, rebuild, writer));
        if (detach || rebuild.state == store::RebuildState::kDone) return {};
        if (rebuild.state == store::RebuildState::kCancelled) {
            return fail(ErrorCode::kCancelled,
                        "the rebuild of collection '" + collection + "' was cancelled");
        }
        if (rebuild.state == store::RebuildState::kFailed) {
            return fail(ErrorCode::kInternal,
                        "the rebuild of collection '" + collection + "' failed: see the log");
        }
        for (;;) {
            RETURN_IF_ERROR(call.checkpointWhileFollowing());
            oneSecond.deadline = std::min(call.run().deadline, RunContext::Clock::now() + kProgressInterval);
            const auto changed = services.rebuilds.waitForChange(rebuild, oneSecond);
            if (changed) {
                rebuild = *changed;
                break;
            }
            if (changed.error().code != ErrorCode::kDeadlineExceeded) return fail(changed.error());
        }
    }
}

// The server's copy of the file that was sent: its name says nothing to the sender.
Error withoutName(Error error, const std::string& file) {
    const std::string name = "'" + file + "'";
    const std::size_t at = error.message.find(name);
    if (at != std::string::npos) error.message.replace(at, name.size(), "the backup");
    return error;
}

Result<void> restoreInto(const Services& services, Call& call, const std::string& file) {
    const auto exclusive = services.restores.exclusive();
    services.rebuilds.pause();
    services.workers.pause();
    Result<void> restored = services.store.restore(file, call.run());
    if (restored) {
        services.restores.replaced();
        restored = services.index.loadAll();
    }
    // Whatever happened: what the store holds now is worked on.
    const auto workers = services.workers.resume();
    const auto rebuilds = services.rebuilds.resume();
    if (!restored) return fail(withoutName(restored.error(), file));
    return workers ? rebuilds : workers;
}

}  // namespace

grpc::Status AdminServiceHandler::Rebuild(grpc::ServerContext* context, const v1::RebuildRequest* request,
                                          RebuildWriter* writer) {
    return handle(services_, context, "Rebuild", [&](Call& call) -> Result<void> {
        if (hasParameters(*request) && (request->cache_only() || request->collection().empty())) {
            return fail(ErrorCode::kInvalidArgument,
                        request->cache_only() ? "parameters cannot change with cache_only: leave one out"
                                              : "collection: new parameters need one to be named");
        }
        std::vector<index::SnapshotPtr> collections = services_.index.all();
        if (!request->collection().empty()) {
            const auto found = call.collection(request->collection());
            RETURN_IF_ERROR(found);
            collections = {*found};
        }
        if (request->cache_only()) return reloadCache(services_, call, collections, *writer);

        RETURN_IF_ERROR(call.becomeFollower());
        // All are started first: they go on should this call be lost while it follows one.
        std::vector<store::Rebuild> started;
        for (const index::SnapshotPtr& snapshot : collections) {
            const auto parameters = parametersFrom(request->profile(), request->segmentation(),
                                                   request->signature(), snapshot->parameters);
            RETURN_IF_ERROR(parameters);
            const RestoreGate::Write write(services_.restores);
            const auto rebuild = services_.rebuilds.begin(snapshot->collection, *parameters);
            RETURN_IF_ERROR(rebuild);
            started.push_back(*rebuild);
        }
        for (std::size_t i = 0; i < started.size(); ++i) {
            const auto followed = follow(services_, call, collections[i]->collection.name, started[i],
                                         request->detach(), *writer);
            if (!followed) return followed;
        }
        return {};
    });
}

grpc::Status AdminServiceHandler::CancelRebuild(grpc::ServerContext* context,
                                                const v1::CancelRebuildRequest* request,
                                                v1::CancelRebuildResponse*) {
    return handle(services_, context, "CancelRebuild", [&](Call& call) -> Result<void> {
        const RestoreGate::Write write(services_.restores);
        const auto found = call.collection(request->collection());
        RETURN_IF_ERROR(found);
        return services_.rebuilds.cancel((*found)->collection);
    });
}

grpc::Status AdminServiceHandler::Backup(grpc::ServerContext* context, const v1::BackupRequest*,
                                         grpc::ServerWriter<v1::BackupChunk>* writer) {
    return handle(services_, context, "Backup", [&](Call& call) -> Result<void> {
        const auto file = TemporaryFile::create(services_.temporaryDirectory);
        RETURN_IF_ERROR(file);
        RETURN_IF_ERROR(services_.store.backup(file->path(), call.run()));
        return sendFile(file->path(), call.run(),
                        [&](const v1::BackupChunk& chunk) { return call.write(*writer, chunk); });
    });
}

grpc::Status AdminServiceHandler::Restore(grpc::ServerContext* context,
                                          grpc::ServerReader<v1::BackupChunk>* reader,
                                          v1::RestoreResponse* response) {
    return handle(services_, context, "Restore", [&](Call& call) -> Result<void> {
        call.expectRestore();
        const auto file = TemporaryFile::create(services_.temporaryDirectory);
        RETURN_IF_ERROR(file);
        auto receiver = FileReceiver::create(file->path());
        RETURN_IF_ERROR(receiver);
        v1::BackupChunk chunk;
        while (call.read(*reader, &chunk)) {
            RETURN_IF_ERROR(call.run().checkpoint());
            RETURN_IF_ERROR(receiver->add(chunk));
        }
        if (call.clientGone()) return fail(ErrorCode::kCancelled, "the client cancelled the restore");
        RETURN_IF_ERROR(receiver->finish());
        call.note({"bytes", receiver->bytes()});

        RETURN_IF_ERROR(services_.restores.beginRestore());
        const Result<void> restored = restoreInto(services_, call, file->path());
        services_.restores.endRestore();
        if (!restored) return restored;
        const auto stats = services_.store.stats();
        RETURN_IF_ERROR(stats);
        response->set_collections(stats->collections);
        response->set_shapes(stats->shapesPending + stats->shapesReady + stats->shapesFailed);
        services_.log->info("database replaced by a backup", {{"shapes", response->shapes()}});
        return {};
    });
}

grpc::Status AdminServiceHandler::Check(grpc::ServerContext* context, const v1::CheckRequest*,
                                        grpc::ServerWriter<v1::CheckProgress>* writer) {
    return handle(services_, context, "Check", [&](Call& call) -> Result<void> {
        RunContext run = call.run();
        auto lastSent = RunContext::Clock::time_point();
        v1::CheckProgress progress;
        run.progress = [&](const char*, std::uint64_t done, std::uint64_t total) {
            progress.set_done(done);
            progress.set_total(total);
            if (RunContext::Clock::now() - lastSent < kProgressInterval) return;
            lastSent = RunContext::Clock::now();
            (void)call.write(*writer, progress);  // a client that has gone is seen by the checkpoint
        };
        const auto problems = services_.store.check(run);
        RETURN_IF_ERROR(problems);
        call.note({"problems", static_cast<std::uint64_t>(problems->size())});
        progress.set_done(progress.total());
        for (const std::string& problem : *problems) {
            progress.add_problems(problem);
            if (progress.ByteSizeLong() < kMaxChunkBytes) continue;
            RETURN_IF_ERROR(call.write(*writer, progress));
            progress.clear_problems();
        }
        progress.set_finished(true);
        return call.write(*writer, progress);
    });
}

grpc::Status AdminServiceHandler::Stats(grpc::ServerContext* context, const v1::StatsRequest*,
                                        v1::StatsResponse* response) {
    return handle(services_, context, "Stats", [&](Call&) -> Result<void> {
        const auto stats = services_.store.stats();
        RETURN_IF_ERROR(stats);
        const auto depth = services_.store.queueDepth();
        RETURN_IF_ERROR(depth);
        const index::CollectionIndex::Totals cache = services_.index.totals();
        const std::uint64_t running = services_.workers.running();
        const std::chrono::duration<double> uptime = std::chrono::system_clock::now() - services_.started;
        response->set_collections(stats->collections);
        response->set_shapes_pending(stats->shapesPending);
        response->set_shapes_ready(stats->shapesReady);
        response->set_shapes_failed(stats->shapesFailed);
        response->set_cached_signatures(cache.signatures);
        response->set_cache_bytes(cache.bytes);
        response->set_queued_jobs(depth->jobs - std::min(depth->jobs, running));
        response->set_queued_bytes(depth->bytes);
        response->set_running_jobs(running);
        response->set_database_bytes(stats->databaseBytes);
        response->set_wal_bytes(stats->walBytes);
        response->set_point_bytes(stats->pointBytes);
        response->set_stored_point_bytes(stats->storedPointBytes);
        response->set_uptime_seconds(uptime.count());
        response->set_searches(services_.searches.count());
        response->set_ingested(services_.workers.ingested());
        return {};
    });
}

grpc::Status AdminServiceHandler::ServerInfo(grpc::ServerContext* context, const v1::ServerInfoRequest*,
                                             v1::ServerInfoResponse* response) {
    return handle(services_, context, "ServerInfo", [&](Call&) -> Result<void> {
        const auto stats = services_.store.stats();
        RETURN_IF_ERROR(stats);
        response->set_version(config::version());
        response->set_schema_version(stats->schemaVersion);
        const auto started = services_.started.time_since_epoch();
        rpc::toProto(std::chrono::duration_cast<std::chrono::milliseconds>(started).count(),
                     response->mutable_started());
        v1::Limits* limits = response->mutable_limits();
        limits->set_max_points(services_.config.limits.maxPoints);
        limits->set_max_k(services_.config.limits.maxK);
        limits->set_max_batch(services_.config.limits.maxBatch);
        limits->set_max_queued_jobs(services_.config.ingest.maxQueuedJobs);
        limits->set_max_queued_bytes(services_.config.ingest.maxQueuedBytes);
        limits->set_max_chunk_bytes(static_cast<std::uint32_t>(kMaxChunkBytes));
        response->set_ingest_threads(
            static_cast<std::uint32_t>(config::threadsOrProcessors(services_.config.ingest.threads)));
        return {};
    });
}

}  // namespace shapedb::rpc
