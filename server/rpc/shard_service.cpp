// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/shard_service.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <iterator>
#include <utility>

#include <grpcpp/grpcpp.h>

#include "core/base/return_if_error.h"
#include "server/catalog/call_frame.h"
#include "server/rpc/cancel_watcher.h"
#include "server/rpc/shard_messages.h"
#include "shapedb/internal/v1/shard_service.grpc.pb.h"

namespace shapedb::rpc {

namespace {

/// Of a cluster's own calls nobody stalls on purpose.
constexpr std::chrono::seconds kStall{60};
constexpr int kMostThreads = 64;
constexpr std::chrono::milliseconds kToLearnOfTheEnd{200};

Result<std::string> readText(const std::string& path) {
    std::ifstream file(path);
    std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (file.good() || (file.eof() && !text.empty())) return text;
    return fail(ErrorCode::kFileNotReadable, "'" + path + "' cannot be read, or is empty");
}

/// The steady clock's moment of a deadline that is given by the wall clock.
RunContext::Clock::time_point deadlineOf(const grpc::ServerContext& context) {
    const auto left = context.deadline() - std::chrono::system_clock::now();
    if (left > std::chrono::hours(1)) return RunContext::Clock::now() + std::chrono::hours(1);
    return RunContext::Clock::now() + std::chrono::duration_cast<RunContext::Clock::duration>(left);
}

}  // namespace

Result<ClusterTls> readClusterTls(const config::ServerConfig::Cluster& config) {
    ClusterTls tls;
    if (config.certificate.empty()) return tls;
    for (const auto& [path, text] :
         {std::pair{&config.certificate, &tls.certificate}, std::pair{&config.key, &tls.key},
          std::pair{&config.ca, &tls.authorities}}) {
        auto read = readText(*path);
        RETURN_IF_ERROR(read);
        *text = std::move(*read);
    }
    return tls;
}

struct ShardServer::Parts : shards::ShardService::Service {
    grpc::Status Find(grpc::ServerContext* context, const shards::FindRequest* request,
                      shards::FindResponse* response) override {
        return answer<cluster::FindRequest>(
            *context, *request, *response,
            [](const auto& own, const auto& asked, const RunContext& run) { return own.find(asked, run); });
    }

    grpc::Status Fit(grpc::ServerContext* context, const shards::FitRequest* request,
                     shards::FitResponse* response) override {
        return answer<cluster::FitRequest>(
            *context, *request, *response,
            [](const auto& own, const auto& asked, const RunContext& run) { return own.fit(asked, run); });
    }

    template <typename Asked, typename Message, typename Response, typename Body>
    grpc::Status answer(grpc::ServerContext& context, const Message& message, Response& response,
                        const Body& body) {
        CancelWatcher::Registration call(cancellations, context);
        const auto done = catalog::guarded([&]() -> Result<void> {
            const cluster::ShardHolder* own = holder.load();
            if (own == nullptr) return fail(ErrorCode::kUnavailable, "this server is starting or stopping");
            const Result<Asked> asked = fromProto(message);
            RETURN_IF_ERROR(asked);
            RunContext run;
            run.cancel = &call.flag();
            run.deadline = deadlineOf(context);
            const auto found = body(*own, *asked, run);
            RETURN_IF_ERROR(found);
            toProto(*found, &response);
            return {};
        });
        return done ? grpc::Status::OK : shardStatus(done.error());
    }

    std::atomic<const cluster::ShardHolder*> holder{nullptr};
    CancelWatcher cancellations{kStall, 0};
    std::unique_ptr<grpc::Server> server;
};

ShardServer::ShardServer() : parts_(std::make_unique<Parts>()) {}

ShardServer::~ShardServer() { shutDown(); }

Result<int> ShardServer::listen(const std::string& endpoint, const ClusterTls& tls) {
    auto credentials = grpc::InsecureServerCredentials();
    if (!tls.certificate.empty()) {
        grpc::SslServerCredentialsOptions options(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
        options.pem_root_certs = tls.authorities;
        options.pem_key_cert_pairs.push_back({tls.key, tls.certificate});
        credentials = grpc::SslServerCredentials(options);
    }
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort(endpoint, credentials, &port);
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    builder.SetMaxReceiveMessageSize(-1);  // from servers of the same cluster
    builder.SetMaxSendMessageSize(-1);
    grpc::ResourceQuota quota("shards");
    quota.SetMaxThreads(kMostThreads);
    builder.SetResourceQuota(quota);
    builder.RegisterService(parts_.get());
    parts_->server = builder.BuildAndStart();
    if (parts_->server && port != 0) return port;
    return fail(ErrorCode::kUnavailable, "cluster.listen: cannot listen on " + endpoint);
}

void ShardServer::serve(const cluster::ShardHolder& holder) { parts_->holder = &holder; }

void ShardServer::shutDown() {
    parts_->holder = nullptr;
    if (!parts_->server) return;
    parts_->cancellations.cutOffAll({ErrorCode::kUnavailable, "the server is shutting down"});
    parts_->server->Shutdown(std::chrono::system_clock::now() + kToLearnOfTheEnd);
    parts_->server->Wait();
    parts_->server.reset();
}

}  // namespace shapedb::rpc
