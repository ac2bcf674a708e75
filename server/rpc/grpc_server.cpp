// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/grpc_server.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/impl/server_builder_option.h>
#include <grpcpp/impl/server_builder_plugin.h>

#include "core/base/return_if_error.h"
#include "server/config/settings.h"
#include "server/net/connections.h"
#include "server/net/listener.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/align_service.h"
#include "server/rpc/cancel_watcher.h"
#include "server/rpc/collection_service.h"
#include "server/rpc/health.h"
#include "server/rpc/limit_table.h"
#include "server/rpc/search_service.h"
#include "server/rpc/services.h"
#include "server/rpc/shape_service.h"
#include "server/rpc/tls_credentials.h"
#include "server/security/key.h"

namespace shapedb::rpc {
namespace {

/// For calls that are cancelled: long enough to learn of it.
constexpr std::chrono::milliseconds kToLearnOfCancellation{200};

/// For servers that strangers reach: reflection asks for no key, and its streams hold threads for as long as
/// they like. gRPC adds it to every server of a program that is linked with it.
class WithoutReflection final : public grpc::ServerBuilderOption {
  public:
    void UpdateArguments(grpc::ChannelArguments*) override {}
    void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
        const auto isReflection = [](const auto& plugin) {
            return plugin->name() == "proto_server_reflection";
        };
        plugins->erase(std::remove_if(plugins->begin(), plugins->end(), isReflection), plugins->end());
    }
};

void limitTransport(grpc::ServerBuilder& builder, const config::ServerConfig::Limits& limits) {
    builder.SetMaxReceiveMessageSize(kMaxReceiveBytes);
    builder.SetMaxSendMessageSize(-1);  // answers are bounded where they are built
    // A compressed message may grow a thousandfold when it is inflated, which gRPC bounds by nothing.
    for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
        builder.SetCompressionAlgorithmSupportStatus(algorithm, false);
    }
    const auto set = [&](const char* name, std::chrono::milliseconds time) {
        builder.AddChannelArgument(name, static_cast<int>(time.count()));
    };
    set(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTime);
    set(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeout);
    set(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kShortestClientPing);
    set(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTime);
    set(GRPC_ARG_MAX_CONNECTION_IDLE_MS, std::chrono::seconds(limits.idleSeconds));
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreamsOfConnection);
    grpc::ResourceQuota quota("shapedbd");
    quota.SetMaxThreads(kMaxCallThreads);
    quota.Resize(kTransportBytes);
    builder.SetResourceQuota(quota);
}

}  // namespace

/// In order of construction; destroyed in reverse.
struct GrpcServer::Parts {
    explicit Parts(Surroundings given)
        : cancellations(std::chrono::seconds(given.config.limits.stallSeconds),
                        given.config.limits.minBytesPerSecond),
          services{given.config,
                   given.catalog,
                   given.admission,
                   cancellations,
                   given.searches,
                   given.access,
                   given.audit,
                   given.metrics,
                   std::move(given.log),
                   std::move(given.temporaryDirectory),
                   std::chrono::system_clock::now(),
                   {}},
          alsoUseTls(std::move(given.alsoUseTls)),
          canSearch(std::move(given.canSearch)),
          shapeService(services),
          searchService(services),
          alignService(services),
          collectionService(services),
          adminService(services) {}

    CancelWatcher cancellations;
    Services services;
    const TlsCredentials::AlsoUse alsoUseTls;
    const std::function<bool()> canSearch;
    ShapeServiceHandler shapeService;
    SearchServiceHandler searchService;
    AlignServiceHandler alignService;
    CollectionServiceHandler collectionService;
    AdminServiceHandler adminService;

    void reportListening(const std::string& problem);
    catalog::Condition condition() const {
        catalog::Condition condition = services.catalog.condition();
        if (canSearch) condition.searches = canSearch();
        return condition;
    }

    /// One way in: a listener, and what gRPC does with its connections.
    struct Entrance {
        net::Listener listener;
        std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
    };
    void open(Entrance& entrance, std::size_t maxConnections);
    Result<std::shared_ptr<grpc::ServerCredentials>> credentials();

    std::unique_ptr<TlsCredentials> tls;  ///< null without TLS
    std::unique_ptr<grpc::Server> server;
    Entrance network;
    Entrance local;                  ///< the Unix socket
    std::unique_ptr<Health> health;  ///< null until it listens
};

GrpcServer::GrpcServer(Surroundings surroundings)
    : parts_(std::make_unique<Parts>(std::move(surroundings))) {}

GrpcServer::~GrpcServer() { shutDown(); }

void GrpcServer::Parts::reportListening(const std::string& problem) {
    if (problem.empty()) {
        services.log->info("connections are accepted again");
        health->listenerRecovered();
    } else {
        services.log->error("connections cannot be accepted", {{"reason", problem}});
        health->listenerFailed();
    }
}

Result<std::shared_ptr<grpc::ServerCredentials>> GrpcServer::Parts::credentials() {
    const config::ServerConfig::Tls& files = services.config.tls;
    if (files.certificate.empty()) return grpc::InsecureServerCredentials();
    auto started =
        TlsCredentials::start({files.certificate, files.key, files.clientCa}, alsoUseTls, services.log);
    RETURN_IF_ERROR(started);
    tls = std::move(*started);
    return tls->credentials();
}

Result<void> GrpcServer::listen() {
    const config::ServerConfig& config = parts_->services.config;
    const auto wanted = config::parseEndpoint(config.listen);
    RETURN_IF_ERROR(wanted);
    RETURN_IF_ERROR(parts_->network.listener.open(*wanted));
    if (!config.unixSocket.empty()) {
        RETURN_IF_ERROR(parts_->local.listener.openUnix(config.unixSocket));
    }
    auto secret = security::makeSecret();
    RETURN_IF_ERROR(secret);
    parts_->services.insideSecret = std::move(*secret);
    const auto credentials = parts_->credentials();
    RETURN_IF_ERROR(credentials);
    RETURN_IF_ERROR(build(*credentials));
    parts_->health = std::make_unique<Health>(*parts_->server->GetHealthCheckService(),
                                              [&parts = *parts_] { return parts.condition(); });
    startListening();
    return {};
}

Result<void> GrpcServer::build(const std::shared_ptr<grpc::ServerCredentials>& credentials) {
    const config::ServerConfig& config = parts_->services.config;
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    if (parts_->services.access.keysRequired) builder.SetOption(std::make_unique<WithoutReflection>());
    // Connections come from our own listeners: see net/listener.h.
    constexpr auto kFromDescriptor = grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD;
    parts_->network.acceptor =
        builder.experimental().AddExternalConnectionAcceptor(kFromDescriptor, credentials);
    if (!config.unixSocket.empty()) {
        // Marks the calls that come through the Unix socket (call.cpp), and takes nothing else.
        parts_->local.acceptor = builder.experimental().AddExternalConnectionAcceptor(
            kFromDescriptor, grpc::experimental::LocalServerCredentials(UDS));
    }
    builder.RegisterService(&parts_->shapeService);
    builder.RegisterService(&parts_->searchService);
    builder.RegisterService(&parts_->alignService);
    builder.RegisterService(&parts_->collectionService);
    builder.RegisterService(&parts_->adminService);
    limitTransport(builder, parts_->services.config.limits);
    parts_->server = builder.BuildAndStart();
    if (!parts_->server) {
        return fail(ErrorCode::kUnavailable,
                    "the gRPC server on " + endpoint().text() + " cannot be started");
    }
    return {};
}

void GrpcServer::startListening() {
    const std::size_t wanted = parts_->services.config.limits.maxConnections;
    const std::size_t most = net::connectionsWithin(net::raiseDescriptorLimit(), wanted,
                                                    config::transports(parts_->services.config));
    const telemetry::LoggerPtr& log = parts_->services.log;
    if (most < wanted) {
        log->warn("the limit of open files leaves room for fewer connections than limits.max_connections",
                  {{"connections", std::uint64_t{most}}, {"wanted", std::uint64_t{wanted}}});
    }
    parts_->open(parts_->network, most);
    if (parts_->local.acceptor) parts_->open(parts_->local, kMaxLocalConnections);
}

void GrpcServer::Parts::open(Entrance& entrance, std::size_t maxConnections) {
    net::ListenerEvents events;
    events.onConnection = [acceptor = entrance.acceptor.get()](int socket) {
        grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
        connection.fd = socket;
        acceptor->HandleNewConnection(&connection);
    };
    events.onProblem = [this](const std::string& problem) { reportListening(problem); };
    events.onTooMany = [log = services.log](std::size_t open) {
        log->warn("too many connections: more are closed at once", {{"open", std::uint64_t{open}}});
    };
    entrance.listener.start(maxConnections, std::move(events));
}

GrpcServer::State GrpcServer::state() const {
    State state;
    for (const Parts::Entrance* entrance : {&parts_->network, &parts_->local}) {
        state.connections += entrance->listener.connections();
        state.connectionsRefused += entrance->listener.refused();
    }
    if (parts_->health) state.accepting = parts_->health->accepting();
    if (parts_->tls) state.certificateExpires = parts_->tls->expires();
    return state;
}

bool GrpcServer::serving() const { return parts_->health->serving(); }

Inside GrpcServer::inside() const {
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);  // as for clients: answers are bounded where they are built
    return {parts_->server->InProcessChannel(arguments), parts_->services.insideSecret};
}

const config::Endpoint& GrpcServer::endpoint() const { return parts_->network.listener.endpoint(); }

void GrpcServer::reportAccepting(bool accepting) {
    accepting ? parts_->health->listenerRecovered() : parts_->health->listenerFailed();
}

void GrpcServer::reportNotServing() {
    if (parts_->health) parts_->health->end();
}

void GrpcServer::shutDown() {
    parts_->network.listener.stop();
    parts_->local.listener.stop();
    if (!parts_->server) return;
    parts_->health->stop();
    parts_->cancellations.cutOffAll(
        {ErrorCode::kUnavailable, "the server is shutting down: send it again after its restart"});
    // Also ends health and reflection streams, which never end by themselves.
    parts_->server->Shutdown(std::chrono::system_clock::now() + kToLearnOfCancellation);
    parts_->server->Wait();
    parts_->server.reset();
}

}  // namespace shapedb::rpc
