// SPDX-License-Identifier: Apache-2.0
// How every rpc is made: deadline, cancellation, retries and errors in one place. Private to client/api.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include <google/protobuf/message.h>
#include <grpcpp/grpcpp.h>

#include "client/api/client.h"
#include "core/base/error.h"
#include "core/base/return_if_error.h"
#include "core/base/run_context.h"
#include "shapedb/v1/admin_service.grpc.pb.h"
#include "shapedb/v1/align_service.grpc.pb.h"
#include "shapedb/v1/collection_service.grpc.pb.h"
#include "shapedb/v1/search_service.grpc.pb.h"
#include "shapedb/v1/shape_service.grpc.pb.h"

namespace shapedb::client {

struct PackedPoints;

struct Client::Impl {
    ClientOptions options;  ///< the address includes the port, apiKey what its file holds
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<v1::ShapeService::Stub> shapes;
    std::unique_ptr<v1::SearchService::Stub> search;
    std::unique_ptr<v1::AlignService::Stub> align;
    std::unique_ptr<v1::CollectionService::Stub> collections;
    std::unique_ptr<v1::AdminService::Stub> admin;

    [[nodiscard]] Result<AddReply> add(const AddRequest& request, const PackedPoints& packed,
                                       const RunContext& context);
    [[nodiscard]] Result<std::vector<std::string>> check(
        const v1::CheckRequest& request, const std::function<void(const CheckProgress&)>& onProgress,
        const RunContext& context);
};

struct CallTraits {
    bool idempotent = true;  ///< may be retried
    bool bounded = true;     ///< ClientOptions::deadline applies
};

constexpr CallTraits kIdempotent{true, true};
constexpr CallTraits kOnce{false, true};
constexpr CallTraits kIdempotentUnbounded{true, false};
constexpr CallTraits kOnceUnbounded{false, false};

/// One attempt: makes the rpc and returns its status. For a failure on this side (a file that cannot be
/// written) it sets `local` and cancels the rpc.
using Attempt = std::function<grpc::Status(grpc::ClientContext& rpc, Result<void>& local)>;

/// Retries until the call succeeds, fails for good or runs out of time, and returns the error of the last
/// attempt. `text`: the message with all text that the attempt sends, null if it sends none. Never throws.
[[nodiscard]] Result<void> makeCall(const ClientOptions& options, const RunContext& context,
                                    CallTraits traits, const google::protobuf::Message* text,
                                    const Attempt& attempt);

/// A unary rpc.
template <typename Stub, typename Request, typename Response>
[[nodiscard]] Result<Response> callUnary(
    const ClientOptions& options, const RunContext& context, CallTraits traits, Stub& stub,
    grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*), const Request& request) {
    Response response;
    const auto made =
        makeCall(options, context, traits, &request, [&](grpc::ClientContext& rpc, Result<void>&) {
            response.Clear();
            return (stub.*method)(&rpc, request, &response);
        });
    RETURN_IF_ERROR(made);
    return response;
}

/// Refuses text that is not UTF-8: protobuf would only complain on standard error and send it all the same.
/// Errors: kInvalidArgument naming the field of the request, at any depth, that is not UTF-8.
[[nodiscard]] Result<void> requireUtf8(const google::protobuf::Message& request);

}  // namespace shapedb::client
