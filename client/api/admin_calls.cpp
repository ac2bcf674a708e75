// SPDX-License-Identifier: Apache-2.0
// AdminService, without files and keys, and grpc.health.v1.
#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/generic/generic_stub.h>

#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

// grpc.health.v1 has one field each way: the name of the service in HealthCheckRequest, the status in
// HealthCheckResponse. Written by hand, which spares a generated file.
constexpr std::uint32_t kServiceTag = 0x0a;  // field 1, length-delimited
constexpr std::uint32_t kStatusTag = 0x08;   // field 1, varint

grpc::ByteBuffer encodeHealthRequest(const std::string& service) {
    std::string bytes;
    if (!service.empty()) {
        google::protobuf::io::StringOutputStream stream(&bytes);
        google::protobuf::io::CodedOutputStream coded(&stream);
        coded.WriteTag(kServiceTag);
        coded.WriteVarint32(static_cast<std::uint32_t>(service.size()));
        coded.WriteString(service);
    }
    const grpc::Slice slice(bytes);
    return {&slice, 1};
}

Health decodeHealthResponse(const grpc::ByteBuffer& buffer) {
    grpc::Slice slice;
    if (!buffer.DumpToSingleSlice(&slice).ok()) return Health::kUnknown;
    google::protobuf::io::CodedInputStream coded(slice.begin(), static_cast<int>(slice.size()));
    std::uint32_t status = 0;
    if (coded.ReadTag() != kStatusTag || !coded.ReadVarint32(&status)) return Health::kUnknown;
    switch (status) {
        case 1: return Health::kServing;
        case 2: return Health::kNotServing;
        default: return Health::kUnknown;
    }
}

}  // namespace

Result<std::vector<RebuildProgress>> Client::rebuild(
    const RebuildRequest& rebuild, const std::function<void(const RebuildProgress&)>& onProgress,
    const RunContext& context) const {
    v1::RebuildRequest request;
    request.set_collection(rebuild.collection);
    request.set_cache_only(rebuild.cacheOnly);
    request.set_detach(rebuild.detach);
    fillParameters(rebuild.parameters, &request);
    std::map<std::string, RebuildProgress> last;
    const auto made = makeCall(impl_->options, context, kOnceUnbounded, &request,
                               [&](grpc::ClientContext& rpc, Result<void>&) {
                                   const auto stream = impl_->admin->Rebuild(&rpc, request);
                                   v1::RebuildProgress message;
                                   while (stream->Read(&message)) {
                                       const RebuildProgress progress = fromWire(message);
                                       last[progress.collection] = progress;
                                       if (onProgress) onProgress(progress);
                                   }
                                   return stream->Finish();
                               });
    RETURN_IF_ERROR(made);
    std::vector<RebuildProgress> results;
    for (auto& [name, progress] : last) results.push_back(std::move(progress));
    return results;
}

Result<void> Client::cancelRebuild(const std::string& collection, const RunContext& context) const {
    v1::CancelRebuildRequest request;
    request.set_collection(collection);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->admin,
                                    &v1::AdminService::Stub::CancelRebuild, request);
    RETURN_IF_ERROR(response);
    return {};
}

Result<std::vector<std::string>> Client::check(const std::function<void(const CheckProgress&)>& onProgress,
                                               const RunContext& context) const {
    return impl_->check({}, onProgress, context);
}

Result<std::vector<std::string>> Client::checkAndAcknowledge(
    const std::function<void(const CheckProgress&)>& onProgress, const RunContext& context) const {
    v1::CheckRequest request;
    request.set_acknowledge(true);
    return impl_->check(request, onProgress, context);
}

Result<std::vector<std::string>> Client::Impl::check(
    const v1::CheckRequest& request, const std::function<void(const CheckProgress&)>& onProgress,
    const RunContext& context) {
    std::vector<std::string> problems;
    const auto made = makeCall(
        options, context, kIdempotentUnbounded, &request, [&](grpc::ClientContext& rpc, Result<void>&) {
            problems.clear();
            const auto stream = admin->Check(&rpc, request);
            v1::CheckProgress message;
            while (stream->Read(&message)) {
                problems.insert(problems.end(), message.problems().begin(), message.problems().end());
                if (!onProgress) continue;
                onProgress({message.done(),
                            message.total(),
                            {message.problems().begin(), message.problems().end()},
                            message.finished()});
            }
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    return problems;
}

Result<Stats> Client::stats(const RunContext& context) const {
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->admin,
                                    &v1::AdminService::Stub::Stats, v1::StatsRequest());
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<ServerInfo> Client::serverInfo(const RunContext& context) const {
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->admin,
                                    &v1::AdminService::Stub::ServerInfo, v1::ServerInfoRequest());
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<Health> Client::health(const std::string& service, const RunContext& context) const {
    Health health = Health::kUnknown;
    const auto made =
        makeCall(impl_->options, context, kOnce, nullptr, [&](grpc::ClientContext& rpc, Result<void>&) {
            grpc::GenericStub stub(impl_->channel);
            grpc::CompletionQueue queue;
            const auto call = stub.PrepareUnaryCall(&rpc, "/grpc.health.v1.Health/Check",
                                                    encodeHealthRequest(service), &queue);
            call->StartCall();
            grpc::ByteBuffer response;
            grpc::Status status;
            call->Finish(&response, &status, nullptr);
            void* tag = nullptr;
            bool ok = false;
            queue.Next(&tag, &ok);
            if (status.ok()) health = decodeHealthResponse(response);
            return status;
        });
    RETURN_IF_ERROR(made);
    return health;
}

}  // namespace shapedb::client
