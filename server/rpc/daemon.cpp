#include "server/rpc/daemon.h"

#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include "core/base/return_if_error.h"
#include "server/catalog/catalog.h"
#include "server/config/settings.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/collection_service.h"
#include "server/rpc/limits.h"
#include "server/rpc/search_service.h"
#include "server/rpc/services.h"
#include "server/rpc/shape_service.h"
#include "server/rpc/temporary_file.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::rpc {
namespace {

constexpr const char* kDatabaseFile = "shapedb.sqlite";
constexpr const char* kTemporaryFolder = "tmp";
constexpr const char* kRebuildJournal = "rebuild.journal";
/// For calls still running when the drain time is over: long enough to learn of it.
constexpr std::chrono::milliseconds kAfterDrain{200};

Result<std::unique_ptr<store::Store>> openStore(const config::ServerConfig& config) {
    namespace fs = std::filesystem;
    std::error_code error;
    // Private to its owner; an existing directory keeps its permissions.
    if (fs::create_directories(config.data, error)) {
        fs::permissions(config.data, fs::perms::owner_all, error);
    }
    if (!error && !fs::is_directory(config.data)) error = std::make_error_code(std::errc::not_a_directory);
    if (error) {
        return fail(ErrorCode::kFileNotWritable,
                    "data directory " + config.data + " cannot be created: " + error.message());
    }
    store::SqliteOptions options;
    options.path = config.data + "/" + kDatabaseFile;
    options.readers = config.store.readers;
    options.pointCompressionLevel = config.store.compressionLevel;
    return store::openSqliteStore(options);
}

catalog::CatalogOptions catalogOptions(const config::ServerConfig& config) {
    catalog::CatalogOptions options;
    options.maxQueuedJobs = config.ingest.maxQueuedJobs;
    options.maxQueuedBytes = config.ingest.maxQueuedBytes;
    options.segmentations = config::threadsOrProcessors(config.search.threads);
    options.workers.threads = config::threadsOrProcessors(config.ingest.threads);
    options.workers.maxAttempts = config.ingest.maxAttempts;
    options.rebuilds.threads = config::threadsOrProcessors(config.rebuild.threads);
    options.rebuilds.maxAttempts = config.ingest.maxAttempts;
    options.rebuilds.journalPath = config.data + "/" + kRebuildJournal;
    return options;
}

/// Names the health service answers for.
constexpr const char* kServiceNames[] = {"shapedb.v1.ShapeService", "shapedb.v1.SearchService",
                                         "shapedb.v1.CollectionService", "shapedb.v1.AdminService"};

}  // namespace

/// In order of construction; destroyed in reverse.
struct Daemon::Parts {
    Parts(const config::ServerConfig& configuration, telemetry::LoggerPtr logger,
          ingest::SignaturePipeline pipeline, std::unique_ptr<store::Store> store)
        : config(configuration),
          log(std::move(logger)),
          catalog(std::move(store), std::move(pipeline), log, catalogOptions(config)),
          admission(config.limits.maxUploadBytes),
          cancellations(std::chrono::seconds(config.limits.stallSeconds)),
          searches(config::threadsOrProcessors(config.search.threads)),
          services{config,
                   catalog,
                   admission,
                   cancellations,
                   searches,
                   log,
                   config.data + "/" + kTemporaryFolder,
                   std::chrono::system_clock::now()},
          shapeService(services),
          searchService(services),
          collectionService(services),
          adminService(services) {}

    Result<void> prepare();
    Result<void> listen();
    Result<void> drain();

    const config::ServerConfig config;
    telemetry::LoggerPtr log;
    catalog::Catalog catalog;
    catalog::Admission admission;
    CancelWatcher cancellations;
    SearchRunner searches;
    Services services;
    ShapeServiceHandler shapeService;
    SearchServiceHandler searchService;
    CollectionServiceHandler collectionService;
    AdminServiceHandler adminService;
    config::Endpoint endpoint;
    std::unique_ptr<grpc::Server> server;
    bool drained = false;
};

Result<void> Daemon::Parts::prepare() {
    RETURN_IF_ERROR(prepareTemporaryDirectory(services.temporaryDirectory));
    return catalog.start();
}

Result<void> Daemon::Parts::listen() {
    const auto wanted = config::parseEndpoint(config.listen);
    RETURN_IF_ERROR(wanted);
    endpoint = *wanted;

    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort(endpoint.text(), grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&shapeService);
    builder.RegisterService(&searchService);
    builder.RegisterService(&collectionService);
    builder.RegisterService(&adminService);
    builder.SetMaxReceiveMessageSize(kMaxReceiveBytes);
    builder.SetMaxSendMessageSize(-1);  // answers are bounded where they are built
    // With port reuse two servers on one port would each get half of the calls.
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    const auto milliseconds = [](std::chrono::milliseconds time) { return static_cast<int>(time.count()); };
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, milliseconds(kKeepaliveTime));
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, milliseconds(kKeepaliveTimeout));
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                               milliseconds(kShortestClientPing));
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
    grpc::ResourceQuota quota("shapedbd");
    quota.SetMaxThreads(kMaxCallThreads);
    builder.SetResourceQuota(quota);
    server = builder.BuildAndStart();
    if (!server || port == 0) {
        return fail(ErrorCode::kUnavailable,
                    "cannot listen on " + config.listen +
                        ": the address is in use, does not belong to this machine, or is not permitted");
    }
    endpoint.port = port;
    for (const char* name : kServiceNames) server->GetHealthCheckService()->SetServingStatus(name, true);
    return {};
}

Result<void> Daemon::Parts::drain() {
    if (std::exchange(drained, true)) return {};
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(config.shutdown.drainSeconds);
    if (server) {
        server->GetHealthCheckService()->SetServingStatus(false);
        admission.calls.drain();
        const bool empty = admission.calls.waitUntilEmpty(until);
        if (!empty) log->warn("drain time is over: cancelling the calls still running");
        // Also ends health and reflection streams, which never end by themselves.
        server->Shutdown(std::chrono::system_clock::now() + kAfterDrain);
        server->Wait();
    }
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
    auto parts = std::make_unique<Parts>(config, std::move(log), std::move(pipeline), std::move(*opened));
    std::unique_ptr<Daemon> daemon(new Daemon(std::move(parts)));
    RETURN_IF_ERROR(daemon->parts_->prepare());
    RETURN_IF_ERROR(daemon->parts_->listen());
    return daemon;
}

const config::Endpoint& Daemon::endpoint() const { return parts_->endpoint; }

Result<void> Daemon::drain() { return parts_->drain(); }

}  // namespace shapedb::rpc
