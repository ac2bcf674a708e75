// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/daemon.h"

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <utility>

#include <unistd.h>

#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"
#include "server/catalog/search_runner.h"
#include "server/catalog/searches.h"
#include "server/cluster_member.h"
#include "server/config/settings.h"
#include "server/files/data_directory.h"
#include "server/http/http_server.h"
#include "server/ingest/crash_marker.h"
#include "server/rpc/grpc_server.h"
#include "server/security/authorization.h"
#include "server/security/keyring.h"
#include "server/server_samples.h"
#include "server/store/parameters_codec.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sqlite/sqlite_key_store.h"
#include "server/store/sqlite/sqlite_store.h"
#include "server/telemetry/audit_log.h"

namespace shapedb {
namespace {

constexpr const char* kTemporaryFolder = "tmp";
constexpr const char* kRebuildJournal = "rebuild.journal";
constexpr const char* kCrashMarker = "crash.marker";
constexpr const char* kAuditFile = "audit.log";

Result<void> acceptParameters(const std::string& text) {
    const auto parameters = store::decodeParameters(text);
    RETURN_IF_ERROR(parameters);
    return {};
}

/// The first line of the file. Errors: kFileNotReadable.
Result<std::string> readPassword(const std::string& path) {
    std::ifstream file(path);
    std::string password;
    if (std::getline(file, password) && !password.empty()) return password;
    return fail(ErrorCode::kFileNotReadable,
                "postgres.password_file: '" + path + "' cannot be read, or its first line is empty");
}

std::string hostName() {
    std::array<char, 64> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? std::string(name.data()) : std::string();
}

/// The same after each start, and another for each data directory of a machine: servers with one name would
/// take each other's work for what they left when they crashed.
std::string nameFor(const std::string& dataDirectory) {
    std::error_code ignored;
    const std::string path = std::filesystem::weakly_canonical(dataDirectory, ignored).string();
    return hostName() + "-" + toHex(sha256(path.data(), path.size())).substr(0, 8);
}

Result<std::unique_ptr<store::Store>> openPostgres(const config::ServerConfig& config) {
    store::PostgresOptions options;
    options.uri = config.postgres.uri;
    if (!config.postgres.passwordFile.empty()) {
        auto password = readPassword(config.postgres.passwordFile);
        RETURN_IF_ERROR(password);
        options.password = std::move(*password);
    }
    options.serverName =
        config.postgres.serverName.empty() ? nameFor(config.data) : config.postgres.serverName;
    options.connections = config.postgres.connections;
    options.pointCompressionLevel = config.store.compressionLevel;
    options.jobLease = std::chrono::seconds(config.postgres.jobLeaseSeconds);
    options.patience = std::chrono::seconds(config.postgres.timeoutSeconds);
    options.lockPath = config.data + "/" + files::kDatabaseName;
    options.temporaryFolder = config.data + "/" + kTemporaryFolder;
    options.acceptParameters = acceptParameters;
    return store::openPostgresStore(options);
}

Result<std::unique_ptr<store::Store>> openStore(const config::ServerConfig& config) {
    RETURN_IF_ERROR(files::prepareDataDirectory(config.data));
    if (config.store.engine == "postgres") return openPostgres(config);
    store::SqliteOptions options;
    options.path = config.data + "/" + files::kDatabaseName;
    options.readers = config.store.readers;
    options.pointCompressionLevel = config.store.compressionLevel;
    options.acceptParameters = acceptParameters;
    return store::openSqliteStore(options);
}

Result<std::unique_ptr<telemetry::AuditLog>> openAudit(const config::ServerConfig& config,
                                                       const telemetry::LoggerPtr& log) {
    const std::string& file = config.security.auditFile;
    return telemetry::AuditLog::open(file.empty() ? config.data + "/" + kAuditFile : file, log);
}

/// A server that cannot be administered may be meant so, or have been set up half.
void warnOfMissingRole(security::Role highest, telemetry::Logger& log) {
    const bool reader = highest == security::Role::kReader;
    log.warn(std::string("no API key that can be used has the role admin: with keys, this server only ") +
                 (reader ? "answers reads, and nobody can store anything" : "takes reads and writes") +
                 "; make one with 'shapedbd key create --role admin' on its machine",
             {{"highest_role", std::string(security::roleName(highest))}});
}

/// Errors: kRejected (keys are required and there is none).
Result<std::unique_ptr<security::Keyring>> openKeys(const config::ServerConfig& config,
                                                    const telemetry::LoggerPtr& log) {
    auto keyring = openKeyring(config.data, log);
    RETURN_IF_ERROR(keyring);
    if (!config::keysRequired(config)) return keyring;
    if (const auto highest = (*keyring)->highestUsableRole()) {
        if (log != nullptr && *highest != security::Role::kAdmin) warnOfMissingRole(*highest, *log);
        return keyring;
    }
    return fail(ErrorCode::kRejected,
                "this server wants API keys, and there is none that can be used: make the first one with "
                "'shapedbd key create --data " +
                    config.data + " --role admin --name NAME'");
}

catalog::CatalogOptions catalogOptions(const config::ServerConfig& config,
                                       const std::vector<store::Crash>& crashes) {
    catalog::CatalogOptions options;
    options.maxQueuedJobs = config.ingest.maxQueuedJobs;
    options.maxQueuedBytes = config.ingest.maxQueuedBytes;
    options.maxPoints = config.limits.maxPoints;
    options.segmentations = config::threadsOrProcessors(config.search.threads);
    const bool elsewhere = config.cluster.replicas > 0 || config.role == "worker";
    options.signatures = elsewhere ? index::Signatures::kElsewhere : index::Signatures::kHere;
    options.segments = config.role != "serve";
    options.workers.threads = config::threadsOrProcessors(config.ingest.threads);
    options.workers.maxAttempts = config.ingest.maxAttempts;
    options.rebuilds.threads = config::threadsOrProcessors(config.rebuild.threads);
    options.rebuilds.maxAttempts = config.ingest.maxAttempts;
    options.workers.crashes = crashes;
    options.rebuilds.crashes = crashes;
    options.rebuilds.journalPath = config.data + "/" + kRebuildJournal;
    return options;
}

}  // namespace

Result<std::unique_ptr<security::Keyring>> openKeyring(const std::string& dataDirectory,
                                                       const telemetry::LoggerPtr& log) {
    RETURN_IF_ERROR(files::prepareDataDirectory(dataDirectory));
    auto store = store::openSqliteKeyStore(dataDirectory + "/" + files::kKeysName);
    RETURN_IF_ERROR(store);
    const auto report = [log](const Error* problem) {
        if (!log) return;
        if (problem == nullptr) return log->info("the stored API keys can be read again");
        log->error("the stored API keys cannot be read: those that are known go on",
                   telemetry::fieldsOf(*problem));
    };
    auto keyring = std::make_unique<security::Keyring>(std::move(*store), security::systemClock(), report);
    RETURN_IF_ERROR(keyring->load());
    return keyring;
}

/// In order of construction; destroyed in reverse.
struct Daemon::Parts {
    Parts(const config::ServerConfig& configuration, telemetry::LoggerPtr logger,
          ingest::SignaturePipeline pipeline, std::unique_ptr<store::Store> store,
          const std::vector<store::Crash>& crashes, std::unique_ptr<security::Keyring> keys,
          std::unique_ptr<telemetry::AuditLog> auditLog, std::unique_ptr<ClusterEntrance> entrance)
        : config(configuration),
          log(std::move(logger)),
          audit(std::move(auditLog)),
          keyring(std::move(keys)),
          usageSaver(*keyring, log),
          access{*keyring, config::keysRequired(config)},
          catalog(std::move(store), std::move(pipeline), log, catalogOptions(config, crashes)),
          admission(config.limits.maxUploadBytes, config.limits.maxUploads),
          runner(config::threadsOrProcessors(config.search.threads)),
          member(entrance == nullptr
                     ? nullptr
                     : std::make_unique<ClusterMember>(std::move(entrance), config, catalog, runner, log)),
          searches(catalog, runner, config.limits.maxK,
                   member == nullptr ? std::nullopt : std::make_optional(member->shards())),
          http(config, log),
          grpc({config, catalog, admission, searches, access, *audit, metrics, log, temporaryDirectory(),
                [this](const security::TlsIdentity& identity) { return http.useTls(identity); },
                [this] { return canSearch(); }}) {}

    bool canSearch() const { return member ? member->canSearch() : catalog.holdsSignatures(); }

    std::string temporaryDirectory() const { return config.data + "/" + kTemporaryFolder; }
    Result<void> serve();
    Result<void> serveHttp();
    Result<void> serveMetrics();
    Result<void> drain();

    const config::ServerConfig config;
    telemetry::LoggerPtr log;
    const std::unique_ptr<telemetry::AuditLog> audit;
    telemetry::Metrics metrics;
    const std::unique_ptr<security::Keyring> keyring;
    security::UsageSaver usageSaver;
    const security::AccessPolicy access;
    catalog::Catalog catalog;
    catalog::Admission admission;
    catalog::SearchRunner runner;
    const std::unique_ptr<ClusterMember> member;  ///< null: it is none of a cluster
    catalog::Searches searches;
    http::HttpServer http;  // before gRPC, whose watcher of the TLS files tells it of new ones
    rpc::GrpcServer grpc;
    bool drained = false;
};

Result<void> Daemon::Parts::serve() {
    RETURN_IF_ERROR(files::prepareTemporaryDirectory(temporaryDirectory()));
    RETURN_IF_ERROR(catalog.start());
    if (member) RETURN_IF_ERROR(member->start());
    RETURN_IF_ERROR(grpc.listen());
    RETURN_IF_ERROR(serveHttp());
    return serveMetrics();
}

Result<void> Daemon::Parts::serveHttp() {
    if (config.http.listen.empty()) return {};
    RETURN_IF_ERROR(http.listen(
        grpc.inside(), [this] { return grpc.serving(); },
        [this](bool accepting) { grpc.reportAccepting(accepting); }));
    log->info("HTTP is served", {{"address", http.endpoint().text()}});
    return {};
}

Result<void> Daemon::Parts::serveMetrics() {
    if (config.metrics.listen.empty()) return {};
    const auto started = std::chrono::system_clock::now();
    metrics.setSampler([this, started] {
        std::optional<cluster::Member::State> state;
        if (member) state = member->state();
        return sampleServer({catalog, admission, runner, grpc, http, config.data, started, state});
    });
    const auto port = metrics.serve(config.metrics.listen);
    RETURN_IF_ERROR(port);
    log->info("metrics are served", {{"address", config.metrics.listen}, {"port", std::int64_t{*port}}});
    return {};
}

Result<void> Daemon::Parts::drain() {
    if (std::exchange(drained, true)) return {};
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(config.shutdown.drainSeconds);
    grpc.reportNotServing();
    // Others ask for its shards until they have them.
    if (member) member->leave();
    http.drain();
    admission.calls.drain();
    const bool empty = admission.calls.waitUntilEmpty(until);
    metrics.stop();
    if (!empty) log->warn("drain time has run out: cancelling the calls still running");
    http.shutDown();
    grpc.shutDown();
    if (member) member->stop();
    return catalog.stop();
}

Daemon::Daemon(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

Daemon::~Daemon() {
    if (const auto drained = drain(); !drained) {
        parts_->log->error("checkpoint at shutdown failed", telemetry::fieldsOf(drained.error()));
    }
}

Result<std::unique_ptr<Daemon>> Daemon::start(const config::ServerConfig& config, telemetry::LoggerPtr log,
                                              ingest::SignaturePipeline pipeline) {
    auto opened = openStore(config);
    RETURN_IF_ERROR(opened);
    for (const std::string& finding : (*opened)->findings()) log->error(finding);
    const auto crashes = ingest::installCrashMarker(config.data + "/" + kCrashMarker);
    RETURN_IF_ERROR(crashes);
    for (const store::Crash& crash : *crashes) {
        log->error("the last process crashed while it segmented a scan", {{"shape", crash.shapeId}});
    }
    auto keys = openKeys(config, log);
    RETURN_IF_ERROR(keys);
    auto audit = openAudit(config, log);
    RETURN_IF_ERROR(audit);
    std::unique_ptr<ClusterEntrance> entrance;
    if (isMember(config)) {
        auto open = openEntrance(config, **opened);
        RETURN_IF_ERROR(open);
        entrance = std::move(*open);
    }
    auto parts = std::make_unique<Parts>(config, std::move(log), std::move(pipeline), std::move(*opened),
                                         *crashes, std::move(*keys), std::move(*audit), std::move(entrance));
    std::unique_ptr<Daemon> daemon(new Daemon(std::move(parts)));
    RETURN_IF_ERROR(daemon->parts_->serve());
    return daemon;
}

const config::Endpoint& Daemon::endpoint() const { return parts_->grpc.endpoint(); }

std::optional<config::Endpoint> Daemon::httpEndpoint() const {
    if (parts_->config.http.listen.empty()) return std::nullopt;
    return parts_->http.endpoint();
}

Result<void> Daemon::drain() { return parts_->drain(); }

}  // namespace shapedb
