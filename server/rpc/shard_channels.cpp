// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/shard_channels.h"

#include <condition_variable>
#include <utility>

#include <grpcpp/grpcpp.h>

#include "server/rpc/shard_messages.h"
#include "shapedb/internal/v1/shard_service.grpc.pb.h"

namespace shapedb::rpc {

namespace {

/// After a failed connection the next try comes soon: a server that was started again is to be found.
constexpr int kReconnectMs = 100;
constexpr int kMostReconnectMs = 1'000;
constexpr char kBeforeStart = '#';

/// One call. What it refers to lives until `done` was called, which its destructor waits for.
template <typename Message, typename Response, typename Answer>
class CallUnderWay final : public cluster::ShardTransport::Request {
  public:
    CallUnderWay(RunContext::Clock::time_point until, cluster::ShardTransport::Done<Answer> done)
        : done_(std::move(done)) {
        const auto left = until - RunContext::Clock::now();
        if (left < std::chrono::hours(1)) {
            context_.set_deadline(std::chrono::system_clock::now() +
                                  std::chrono::duration_cast<std::chrono::system_clock::duration>(left));
        }
    }
    ~CallUnderWay() override {
        std::unique_lock<std::mutex> lock(mutex_);
        ended_.wait(lock, [this] { return over_; });
    }

    void cancel() override { context_.TryCancel(); }

    void end(const grpc::Status& status) {
        // The destructor may run as soon as the lock is released: nothing is used after it.
        Result<Answer> answer = status.ok() ? fromProto(response) : fail(shardError(status));
        done_(std::move(answer));
        const std::lock_guard<std::mutex> lock(mutex_);
        over_ = true;
        ended_.notify_all();
    }

    grpc::ClientContext* context() { return &context_; }
    Message request;
    Response response;

  private:
    grpc::ClientContext context_;
    const cluster::ShardTransport::Done<Answer> done_;
    std::mutex mutex_;
    std::condition_variable ended_;
    bool over_ = false;
};

}  // namespace

std::string memberName(const std::string& address, const std::string& start) {
    return address + kBeforeStart + start;
}

std::string addressOf(const std::string& memberName) {
    return memberName.substr(0, memberName.find(kBeforeStart));
}

struct ShardChannels::Peer {
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<shards::ShardService::Stub> stub;
};

ShardChannels::ShardChannels(ClusterTls tls) : tls_(std::move(tls)) {}

ShardChannels::~ShardChannels() = default;

std::shared_ptr<ShardChannels::Peer> ShardChannels::peer(const std::string& server) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::shared_ptr<Peer>& known = peers_[addressOf(server)];
    if (known) return known;
    auto credentials = grpc::InsecureChannelCredentials();
    if (!tls_.certificate.empty()) {
        credentials = grpc::SslCredentials({tls_.authorities, tls_.key, tls_.certificate});
    }
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);
    arguments.SetMaxSendMessageSize(-1);
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kReconnectMs);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kReconnectMs);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMostReconnectMs);
    // Not what the environment says of proxies: these are neighbours.
    arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
    known = std::make_shared<Peer>();
    known->channel = grpc::CreateCustomChannel(addressOf(server), credentials, arguments);
    known->stub = shards::ShardService::NewStub(known->channel);
    return known;
}

std::unique_ptr<cluster::ShardTransport::Request> ShardChannels::find(const std::string& server,
                                                                      const cluster::FindRequest& request,
                                                                      RunContext::Clock::time_point until,
                                                                      Done<cluster::FindAnswer> done) {
    using FindCall = CallUnderWay<shards::FindRequest, shards::FindResponse, cluster::FindAnswer>;
    auto call = std::make_unique<FindCall>(until, std::move(done));
    toProto(request, &call->request);
    peer(server)->stub->async()->Find(call->context(), &call->request, &call->response,
                                      [one = call.get()](const grpc::Status& status) { one->end(status); });
    return call;
}

std::unique_ptr<cluster::ShardTransport::Request> ShardChannels::fit(const std::string& server,
                                                                     const cluster::FitRequest& request,
                                                                     RunContext::Clock::time_point until,
                                                                     Done<cluster::FitAnswer> done) {
    using FitCall = CallUnderWay<shards::FitRequest, shards::FitResponse, cluster::FitAnswer>;
    auto call = std::make_unique<FitCall>(until, std::move(done));
    toProto(request, &call->request);
    peer(server)->stub->async()->Fit(call->context(), &call->request, &call->response,
                                     [one = call.get()](const grpc::Status& status) { one->end(status); });
    return call;
}

}  // namespace shapedb::rpc
