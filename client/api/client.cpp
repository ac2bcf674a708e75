// SPDX-License-Identifier: Apache-2.0
#include "client/api/client.h"

#include <string>

#include <grpcpp/grpcpp.h>

#include "client/api/call.h"
#include "client/api/call_failure.h"
#include "client/api/channel.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

/// Reconnecting keeps pace with RetryPolicy.
constexpr int kFirstReconnectMs = 100;
constexpr int kLongestReconnectMs = 2000;
/// What one attempt may take, until the server's first frame: a busy server or a distant one needs its time.
/// (gRPC's own name for this is misleading: its minimum for the backoff bounds the attempt, not the wait.)
constexpr int kConnectTimeoutMs = 5000;

grpc::ChannelArguments channelArguments() {
    grpc::ChannelArguments arguments;
    // A reply may be large: 1,000 hits with metadata and explanations.
    arguments.SetMaxReceiveMessageSize(-1);
    // call.cpp retries, by the server's error names; gRPC must not retry as well.
    arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnectMs);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectTimeoutMs);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestReconnectMs);
    // Each Client has its own connection.
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return arguments;
}

}  // namespace

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

Result<Client> Client::connect(ClientOptions options) {
    auto address = checkedAddress(options.address);
    RETURN_IF_ERROR(address);
    if (options.deadline.count() < 0) {
        return fail(ErrorCode::kInvalidArgument,
                    "deadline is " + std::to_string(options.deadline.count()) + " ms; it must be at least 0");
    }
    RETURN_IF_ERROR(validate(options.retry));
    try {
        auto impl = std::make_unique<Impl>();
        options.address = std::move(*address);
        auto key = apiKeyOf(options);
        RETURN_IF_ERROR(key);
        options.apiKey = std::move(*key);
        grpc::ChannelArguments arguments = channelArguments();
        const auto credentials = channelCredentials(options.tls, arguments);
        RETURN_IF_ERROR(credentials);
        impl->options = std::move(options);
        impl->channel = grpc::CreateCustomChannel(impl->options.address, *credentials, arguments);
        impl->shapes = v1::ShapeService::NewStub(impl->channel);
        impl->search = v1::SearchService::NewStub(impl->channel);
        impl->align = v1::AlignService::NewStub(impl->channel);
        impl->collections = v1::CollectionService::NewStub(impl->channel);
        impl->admin = v1::AdminService::NewStub(impl->channel);
        return Client(std::move(impl));
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for a connection");
    }
}

const std::string& Client::address() const { return impl_->options.address; }

}  // namespace shapedb::client
