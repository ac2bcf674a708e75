#include "server/rpc/grpc_server.h"

#include <chrono>
#include <utility>

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include "server/rpc/admin_service.h"
#include "server/rpc/align_service.h"
#include "server/rpc/cancel_watcher.h"
#include "server/rpc/collection_service.h"
#include "server/rpc/message_limits.h"
#include "server/rpc/search_service.h"
#include "server/rpc/services.h"
#include "server/rpc/shape_service.h"

namespace shapedb::rpc {
namespace {

/// For calls that are cancelled: long enough to learn of it.
constexpr std::chrono::milliseconds kToLearnOfCancellation{200};

/// Names the health service answers for.
constexpr const char* kServiceNames[] = {"shapedb.v1.ShapeService", "shapedb.v1.SearchService",
                                         "shapedb.v1.CollectionService", "shapedb.v1.AlignService",
                                         "shapedb.v1.AdminService"};

}  // namespace

/// In order of construction; destroyed in reverse.
struct GrpcServer::Parts {
    Parts(const config::ServerConfig& config, catalog::Catalog& catalog, catalog::Admission& admission,
          catalog::Searches& searches, telemetry::LoggerPtr log, std::string temporaryDirectory)
        : cancellations(std::chrono::seconds(config.limits.stallSeconds)),
          services{config,
                   catalog,
                   admission,
                   cancellations,
                   searches,
                   std::move(log),
                   std::move(temporaryDirectory),
                   std::chrono::system_clock::now()},
          shapeService(services),
          searchService(services),
          alignService(services),
          collectionService(services),
          adminService(services) {}

    CancelWatcher cancellations;
    Services services;
    ShapeServiceHandler shapeService;
    SearchServiceHandler searchService;
    AlignServiceHandler alignService;
    CollectionServiceHandler collectionService;
    AdminServiceHandler adminService;
    config::Endpoint endpoint;
    std::unique_ptr<grpc::Server> server;
};

GrpcServer::GrpcServer(const config::ServerConfig& config, catalog::Catalog& catalog,
                       catalog::Admission& admission, catalog::Searches& searches, telemetry::LoggerPtr log,
                       std::string temporaryDirectory)
    : parts_(std::make_unique<Parts>(config, catalog, admission, searches, std::move(log),
                                     std::move(temporaryDirectory))) {}

GrpcServer::~GrpcServer() { shutDown(); }

Result<void> GrpcServer::listen(const config::Endpoint& wanted) {
    parts_->endpoint = wanted;
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort(parts_->endpoint.text(), grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&parts_->shapeService);
    builder.RegisterService(&parts_->searchService);
    builder.RegisterService(&parts_->alignService);
    builder.RegisterService(&parts_->collectionService);
    builder.RegisterService(&parts_->adminService);
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
    parts_->server = builder.BuildAndStart();
    if (!parts_->server || port == 0) {
        return fail(ErrorCode::kUnavailable,
                    "cannot listen on " + wanted.text() +
                        ": the address is in use, does not belong to this machine, or is not permitted");
    }
    parts_->endpoint.port = port;
    for (const char* name : kServiceNames)
        parts_->server->GetHealthCheckService()->SetServingStatus(name, true);
    return {};
}

const config::Endpoint& GrpcServer::endpoint() const { return parts_->endpoint; }

void GrpcServer::reportNotServing() {
    if (parts_->server) parts_->server->GetHealthCheckService()->SetServingStatus(false);
}

void GrpcServer::shutDown() {
    if (!parts_->server) return;
    // Also ends health and reflection streams, which never end by themselves.
    parts_->server->Shutdown(std::chrono::system_clock::now() + kToLearnOfCancellation);
    parts_->server->Wait();
    parts_->server.reset();
}

}  // namespace shapedb::rpc
