// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin rebuild|check|stats|info`.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/parameters.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct RebuildFlags {
    client::RebuildRequest request;
    ParameterFlags parameters;
    bool cancel = false;
};

std::string collectionText(const std::string& name) { return name.empty() ? "all collections" : name; }

CommandResult runCancelRebuild(Session& session, const client::Client& client, const RebuildFlags& flags) {
    session.leftBehind = kPerhapsChanged;
    const auto cancelled = client.cancelRebuild(flags.request.collection, session.context());
    RETURN_IF_ERROR(cancelled);
    session.console().document({{"cancelled", flags.request.collection}});
    session.console().text(collectionText(flags.request.collection) + ": rebuild cancelled\n");
    return kOk;
}

CommandResult runRebuild(Session& session, const RebuildFlags& flags) {
    session.leftBehind = "the server goes on; the same command follows it again";
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    if (flags.cancel) return runCancelRebuild(session, *client, flags);
    client::RebuildRequest request = flags.request;
    request.parameters = flags.parameters.given;
    const auto results = client->rebuild(
        request,
        [&](const client::RebuildProgress& progress) {
            session.console().progress("rebuild " + progress.collection, progress.done, progress.total);
        },
        session.context());
    RETURN_IF_ERROR(results);

    json list = json::array();
    Table table(
        {{"collection"}, {"shapes", Table::Align::kRight}, {"failed", Table::Align::kRight}, {"time"}, {""}});
    for (const client::RebuildProgress& one : *results) {
        list.push_back({{"collection", one.collection},
                        {"done", one.done},
                        {"total", one.total},
                        {"failed", one.failed},
                        {"finished", one.finished},
                        {"seconds", one.seconds}});
        table.add({one.collection, formatCount(one.done) + " / " + formatCount(one.total),
                   formatCount(one.failed), formatSeconds(one.seconds),
                   one.finished ? "done" : "continues in the background"});
    }
    session.console().document({{"rebuilt", list}});
    session.console().text(table.empty() ? "nothing to rebuild\n" : table.render());
    return kOk;
}

CommandResult runCheck(Session& session, bool acknowledge) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto onProgress = [&](const client::CheckProgress& progress) {
        session.console().progress("check", progress.done, progress.total);
    };
    const auto problems = acknowledge ? client->checkAndAcknowledge(onProgress, session.context())
                                      : client->check(onProgress, session.context());
    RETURN_IF_ERROR(problems);
    session.console().document({{"sound", problems->empty()}, {"problems", *problems}});
    for (const std::string& problem : *problems) session.console().text(problem + "\n");
    session.console().text(problems->empty()
                               ? "the database is sound\n"
                               : formatCount(problems->size(), "problem", "problems") + " found\n");
    if (acknowledge) session.console().text("missing changes will not be reported again\n");
    return problems->empty() ? kOk : kDefect;
}

CommandResult runStats(Session& session) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto stats = client->stats(session.context());
    RETURN_IF_ERROR(stats);
    session.console().document({{"collections", stats->collections},
                                {"shapes_pending", stats->shapesPending},
                                {"shapes_ready", stats->shapesReady},
                                {"shapes_failed", stats->shapesFailed},
                                {"cached_signatures", stats->cachedSignatures},
                                {"cache_bytes", stats->cacheBytes},
                                {"queued_jobs", stats->queuedJobs},
                                {"queued_bytes", stats->queuedBytes},
                                {"running_jobs", stats->runningJobs},
                                {"database_bytes", stats->databaseBytes},
                                {"wal_bytes", stats->walBytes},
                                {"missing_commits", stats->missingCommits},
                                {"point_bytes", stats->pointBytes},
                                {"stored_point_bytes", stats->storedPointBytes},
                                {"uptime_seconds", stats->uptimeSeconds},
                                {"searches", stats->searches},
                                {"ingested", stats->ingested}});
    Table table({{""}, {""}});
    table.add({"collections", formatCount(stats->collections)});
    table.add({"shapes", formatCount(stats->shapesReady) + " ready, " + formatCount(stats->shapesPending) +
                             " pending, " + formatCount(stats->shapesFailed) + " failed"});
    table.add({"cache", formatCount(stats->cachedSignatures, "signature", "signatures") + ", " +
                            formatBytes(stats->cacheBytes)});
    table.add({"queue", formatCount(stats->queuedJobs, "scan", "scans") + ", " +
                            formatBytes(stats->queuedBytes) + "; " + formatCount(stats->runningJobs) +
                            " running"});
    table.add({"database", formatBytes(stats->databaseBytes) + ", log " + formatBytes(stats->walBytes)});
    if (stats->missingCommits > 0) {
        table.add({"missing", formatCount(stats->missingCommits) + " acknowledged changes: see admin check"});
    }
    table.add(
        {"points", formatBytes(stats->pointBytes) + ", compressed " + formatBytes(stats->storedPointBytes)});
    table.add({"uptime", formatSeconds(stats->uptimeSeconds) + ", " +
                             formatCount(stats->searches, "search", "searches") + ", " +
                             formatCount(stats->ingested, "scan", "scans") + " segmented"});
    session.console().text(table.render());
    return kOk;
}

CommandResult runInfo(Session& session) {
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const auto info = client->serverInfo(session.context());
    RETURN_IF_ERROR(info);
    const client::Limits& limits = info->limits;
    json all = json::array();
    Table limitTable({{"limit"}, {"value", Table::Align::kRight}, {"unit"}, {"beyond it"}, {"bounds"}});
    for (const client::Limit& one : info->limitTable) {
        all.push_back({{"name", one.name},
                       {"value", one.value},
                       {"unit", one.unit},
                       {"bounds", one.bounds},
                       {"refusal", one.refusal}});
        limitTable.add({one.name, formatCount(one.value), one.unit, one.refusal, one.bounds});
    }
    session.console().document({{"server", client->address()},
                                {"version", info->version},
                                {"schema_version", info->schemaVersion},
                                {"ingest_threads", info->ingestThreads},
                                {"limits",
                                 {{"max_points", limits.maxPoints},
                                  {"max_k", limits.maxK},
                                  {"max_batch", limits.maxBatch},
                                  {"max_queued_jobs", limits.maxQueuedJobs},
                                  {"max_queued_bytes", limits.maxQueuedBytes},
                                  {"max_chunk_bytes", limits.maxChunkBytes}}},
                                {"limit_table", all}});
    Table table({{""}, {""}});
    table.add({"server", client->address()});
    table.add({"version", info->version + ", database schema " + std::to_string(info->schemaVersion)});
    table.add({"ingest threads", std::to_string(info->ingestThreads)});
    table.add({"points per scan", "up to " + formatCount(limits.maxPoints)});
    table.add({"hits per search", "up to " + formatCount(limits.maxK)});
    table.add({"ingest queue", "up to " + formatCount(limits.maxQueuedJobs, "scan", "scans") + " and " +
                                   formatBytes(limits.maxQueuedBytes)});
    session.console().text(table.render() + "\n" + limitTable.render());
    return kOk;
}

void addRebuild(CLI::App& group, Session& session) {
    auto flags = std::make_shared<RebuildFlags>();
    CLI::App* command = group.add_subcommand(
        "rebuild", "Segment stored scans again, or follow a running rebuild; searches are not interrupted");
    command->add_option("--collection", flags->request.collection, "Only this collection [all]")
        ->type_name("NAME");
    command->add_flag("--cancel", flags->cancel, "Stop a running rebuild and discard its partial result");
    command->add_flag("--cache-only", flags->request.cacheOnly,
                      "Only reload the signatures from the database into the cache");
    command->add_flag("--detach", flags->request.detach, "Start the rebuild and return");
    addParameterFlags(*command, flags->parameters);
    addUnitsFlag(*command, flags->parameters);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runRebuild(session, *flags); }; });
}

void addPlainCommand(CLI::App& group, Session& session, const char* name, const char* help,
                     CommandResult (*runner)(Session&)) {
    group.add_subcommand(name, help)->callback([&session, runner] {
        session.action = [&session, runner] { return runner(session); };
    });
}

void addCheck(CLI::App& group, Session& session) {
    CLI::App* command = group.add_subcommand("check", "Read the whole database and report damage");
    const auto acknowledge = std::make_shared<bool>(false);
    command->add_flag("--acknowledge", *acknowledge,
                      "Do not report again that acknowledged changes are missing");
    command->callback([&session, acknowledge] {
        session.action = [&session, acknowledge] { return runCheck(session, *acknowledge); };
    });
}

}  // namespace

void addAdminCommands(CLI::App& app, Session& session) {
    CLI::App* group = app.add_subcommand("admin", "Maintain a running server");
    group->require_subcommand(1);
    addRebuild(*group, session);
    addBackupCommands(*group, session);
    addCopyCommand(*group, session);
    addCheck(*group, session);
    addPlainCommand(*group, session, "stats", "Show counts and sizes", &runStats);
    addPlainCommand(*group, session, "info", "Show version and limits", &runInfo);
    addKeyCommands(*group, session);
}

}  // namespace shapedb::cli
