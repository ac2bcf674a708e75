#include "server/rpc/admin_service.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"
#include "server/catalog/temporary_file.h"
#include "server/config/load.h"
#include "server/rpc/backup_stream.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"

namespace shapedb::rpc {
namespace {

using RebuildWriter = grpc::ServerWriter<v1::RebuildProgress>;

catalog::RebuildRequest rebuildRequestFrom(const v1::RebuildRequest& request) {
    catalog::RebuildRequest wanted;
    wanted.collection = request.collection();
    wanted.cacheOnly = request.cache_only();
    if (request.has_segmentation() || request.has_signature() ||
        request.profile() != v1::PROFILE_UNSPECIFIED) {
        wanted.change = [&request](const ShapeParameters& current) {
            return parametersFrom(request.profile(), request.segmentation(), request.signature(), current);
        };
    }
    return wanted;
}

/// Reads the stored signatures again; nothing is segmented.
Result<void> reloadCache(const Services& services, Call& call, const std::vector<std::string>& names,
                         RebuildWriter& writer) {
    for (const std::string& name : names) {
        const auto began = std::chrono::steady_clock::now();
        const auto reloaded = services.catalog.reload(name);
        RETURN_IF_ERROR(reloaded);
        const std::uint64_t count = (*reloaded)->signatures.size();
        v1::RebuildProgress progress;
        progress.set_collection(name);
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

}  // namespace

grpc::Status AdminServiceHandler::Rebuild(grpc::ServerContext* context, const v1::RebuildRequest* request,
                                          RebuildWriter* writer) {
    return handle(services_, context, "Rebuild", [&](Call& call) -> Result<void> {
        const catalog::RebuildRequest wanted = rebuildRequestFrom(*request);
        if (!wanted.collection.empty()) call.noteCollection(wanted.collection);
        const auto names = services_.catalog.rebuildTargets(wanted);
        RETURN_IF_ERROR(names);
        if (wanted.cacheOnly) return reloadCache(services_, call, *names, *writer);

        RETURN_IF_ERROR(call.frame().becomeFollower());
        const auto started = services_.catalog.beginRebuilds(*names, wanted.change);
        RETURN_IF_ERROR(started);
        for (std::size_t i = 0; i < started->size(); ++i) {
            const std::string& name = (*names)[i];
            const store::Rebuild& begun = (*started)[i];
            const auto send = [&](const store::Rebuild& rebuild) {
                return sendProgress(call, name, rebuild, *writer);
            };
            RETURN_IF_ERROR(request->detach()
                                ? send(begun)
                                : services_.catalog.followRebuild(
                                      name, begun, call.run(),
                                      [&] { return call.frame().checkpointWhileFollowing(); }, send));
        }
        return {};
    });
}

grpc::Status AdminServiceHandler::CancelRebuild(grpc::ServerContext* context,
                                                const v1::CancelRebuildRequest* request,
                                                v1::CancelRebuildResponse*) {
    return handle(services_, context, "CancelRebuild", [&](Call& call) -> Result<void> {
        call.noteCollection(request->collection());
        return services_.catalog.cancelRebuild(request->collection());
    });
}

grpc::Status AdminServiceHandler::Backup(grpc::ServerContext* context, const v1::BackupRequest*,
                                         grpc::ServerWriter<v1::BackupChunk>* writer) {
    return handle(services_, context, "Backup", [&](Call& call) -> Result<void> {
        const auto file = catalog::TemporaryFile::create(services_.temporaryDirectory);
        RETURN_IF_ERROR(file);
        RETURN_IF_ERROR(services_.catalog.backup(file->path(), call.run()));
        return sendFile(file->path(), call.run(),
                        [&](const v1::BackupChunk& chunk) { return call.write(*writer, chunk); });
    });
}

grpc::Status AdminServiceHandler::Restore(grpc::ServerContext* context,
                                          grpc::ServerReader<v1::BackupChunk>* reader,
                                          v1::RestoreResponse* response) {
    return handle(services_, context, "Restore", [&](Call& call) -> Result<void> {
        call.frame().expectRestore();
        const auto file = catalog::TemporaryFile::create(services_.temporaryDirectory);
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

        RETURN_IF_ERROR(services_.catalog.restore(file->path(), call.run()));
        const auto stats = services_.catalog.stats();
        RETURN_IF_ERROR(stats);
        const store::StoreStats& stored = stats->store;
        response->set_collections(stored.collections);
        response->set_shapes(stored.shapesPending + stored.shapesReady + stored.shapesFailed);
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
            if (RunContext::Clock::now() - lastSent < catalog::kProgressInterval) return;
            lastSent = RunContext::Clock::now();
            (void)call.write(*writer, progress);  // the checkpoint notices a client that has gone
        };
        const auto problems = services_.catalog.check(run);
        RETURN_IF_ERROR(problems);
        call.note({"problems", static_cast<std::uint64_t>(problems->size())});
        progress.set_done(progress.total());
        for (const std::string& problem : *problems) {
            progress.add_problems(problem);
            if (progress.ByteSizeLong() < catalog::kMaxChunkBytes) continue;
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
        const auto stats = services_.catalog.stats();
        RETURN_IF_ERROR(stats);
        const store::StoreStats& stored = stats->store;
        const std::chrono::duration<double> uptime = std::chrono::system_clock::now() - services_.started;
        response->set_collections(stored.collections);
        response->set_shapes_pending(stored.shapesPending);
        response->set_shapes_ready(stored.shapesReady);
        response->set_shapes_failed(stored.shapesFailed);
        response->set_cached_signatures(stats->index.signatures);
        response->set_cache_bytes(stats->index.bytes);
        response->set_queued_jobs(stats->queued);
        response->set_queued_bytes(stats->queue.bytes);
        response->set_running_jobs(stats->running);
        response->set_database_bytes(stored.databaseBytes);
        response->set_wal_bytes(stored.walBytes);
        response->set_point_bytes(stored.pointBytes);
        response->set_stored_point_bytes(stored.storedPointBytes);
        response->set_uptime_seconds(uptime.count());
        response->set_searches(services_.searches.count());
        response->set_ingested(stats->ingested);
        return {};
    });
}

grpc::Status AdminServiceHandler::ServerInfo(grpc::ServerContext* context, const v1::ServerInfoRequest*,
                                             v1::ServerInfoResponse* response) {
    return handle(services_, context, "ServerInfo", [&](Call&) -> Result<void> {
        const auto stats = services_.catalog.stats();
        RETURN_IF_ERROR(stats);
        response->set_version(config::version());
        response->set_schema_version(stats->store.schemaVersion);
        const auto started = services_.started.time_since_epoch();
        rpc::toProto(std::chrono::duration_cast<std::chrono::milliseconds>(started).count(),
                     response->mutable_started());
        v1::Limits* limits = response->mutable_limits();
        limits->set_max_points(services_.config.limits.maxPoints);
        limits->set_max_k(services_.config.limits.maxK);
        limits->set_max_batch(services_.config.limits.maxBatch);
        limits->set_max_queued_jobs(services_.config.ingest.maxQueuedJobs);
        limits->set_max_queued_bytes(services_.config.ingest.maxQueuedBytes);
        limits->set_max_chunk_bytes(static_cast<std::uint32_t>(catalog::kMaxChunkBytes));
        response->set_ingest_threads(
            static_cast<std::uint32_t>(config::threadsOrProcessors(services_.config.ingest.threads)));
        return {};
    });
}

}  // namespace shapedb::rpc
