// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/admin_service.h"

#include <chrono>
#include <string>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"
#include "server/config/load.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/limit_table.h"

namespace shapedb::rpc {
namespace {

Result<catalog::RebuildRequest> rebuildRequestFrom(const v1::RebuildRequest& request) {
    catalog::RebuildRequest wanted;
    wanted.collection = request.collection();
    wanted.cacheOnly = request.cache_only();
    wanted.detached = request.detach();
    if (request.has_segmentation() || request.has_signature() ||
        request.profile() != v1::PROFILE_UNSPECIFIED) {
        auto change = overridesFrom(request.profile(), request.segmentation(), request.signature());
        RETURN_IF_ERROR(change);
        wanted.change = *change;
    }
    return wanted;
}

v1::RebuildProgress progressFrom(const catalog::RebuildProgress& progress) {
    v1::RebuildProgress message;
    message.set_collection(progress.collection);
    message.set_done(progress.done);
    message.set_total(progress.total);
    message.set_failed(progress.failed);
    message.set_finished(progress.finished);
    message.set_seconds(progress.seconds);
    return message;
}

}  // namespace

AdminServiceHandler::AdminServiceHandler(const Services& services) : services_(services) {
    serve("Rebuild", this, &AdminServiceHandler::rebuild);
    serve("CancelRebuild", this, &AdminServiceHandler::cancelRebuild);
    serve("Backup", this, &AdminServiceHandler::backup);
    serve("Restore", this, &AdminServiceHandler::restore);
    serve("ImportCollection", this, &AdminServiceHandler::importCollection);
    serve("ExportCollection", this, &AdminServiceHandler::exportCollection);
    serve("Check", this, &AdminServiceHandler::check);
    serve("Stats", this, &AdminServiceHandler::stats);
    serve("ServerInfo", this, &AdminServiceHandler::serverInfo);
    serve("CreateKey", this, &AdminServiceHandler::createKey);
    serve("ListKeys", this, &AdminServiceHandler::listKeys);
    serve("RevokeKey", this, &AdminServiceHandler::revokeKey);
}

grpc::Status AdminServiceHandler::rebuild(grpc::ServerContext* context, Request<v1::RebuildRequest>& request,
                                          Replies<v1::RebuildProgress>* writer) {
    return handle(services_, context, operations::kRebuild, request, [&](Call& call) -> Result<void> {
        auto wanted = rebuildRequestFrom(*request);
        RETURN_IF_ERROR(wanted);
        if (wanted->collection.empty()) {
            RETURN_IF_ERROR(call.useAllCollections());
        } else {
            auto named = call.useCollection(wanted->collection);
            RETURN_IF_ERROR(named);
            wanted->collection = std::move(*named);
        }
        return services_.catalog.rebuild(*wanted, call.frame(),
                                         [&](const catalog::RebuildProgress& progress) {
                                             return call.write(*writer, progressFrom(progress));
                                         });
    });
}

grpc::Status AdminServiceHandler::cancelRebuild(grpc::ServerContext* context,
                                                Request<v1::CancelRebuildRequest>& request,
                                                v1::CancelRebuildResponse*) {
    return handle(services_, context, operations::kCancelRebuild, request, [&](Call& call) -> Result<void> {
        const auto collection = call.useCollection(request->collection());
        RETURN_IF_ERROR(collection);
        return services_.catalog.cancelRebuild(*collection);
    });
}

grpc::Status AdminServiceHandler::check(grpc::ServerContext* context, Request<v1::CheckRequest>& request,
                                        Replies<v1::CheckProgress>* writer) {
    return handle(services_, context, operations::kCheck, request, [&](Call& call) -> Result<void> {
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
        if (request->acknowledge()) RETURN_IF_ERROR(services_.catalog.acknowledge());
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

grpc::Status AdminServiceHandler::stats(grpc::ServerContext* context, Request<v1::StatsRequest>& request,
                                        v1::StatsResponse* response) {
    return handle(services_, context, operations::kStats, request, [&](Call&) -> Result<void> {
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
        response->set_missing_commits(stored.missingCommits);
        return {};
    });
}

grpc::Status AdminServiceHandler::serverInfo(grpc::ServerContext* context,
                                             Request<v1::ServerInfoRequest>& request,
                                             v1::ServerInfoResponse* response) {
    return handle(services_, context, operations::kServerInfo, request, [&](Call&) -> Result<void> {
        const auto stats = services_.catalog.stats();
        // What a client must know to send anything does not depend on the database.
        if (!stats && stats.error().code != ErrorCode::kDataLoss) return fail(stats.error());
        response->set_version(config::version());
        if (stats) response->set_schema_version(stats->store.schemaVersion);
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
        for (const LimitRow& row : limitTable(services_.config)) {
            v1::Limit* limit = response->add_limit_table();
            limit->set_name(row.name);
            limit->set_value(row.value);
            limit->set_unit(row.unit);
            limit->set_bounds(row.bounds);
            limit->set_refusal(row.refusal);
        }
        response->set_ingest_threads(
            static_cast<std::uint32_t>(config::threadsOrProcessors(services_.config.ingest.threads)));
        return {};
    });
}

}  // namespace shapedb::rpc
