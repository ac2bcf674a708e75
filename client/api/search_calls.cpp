// SPDX-License-Identifier: Apache-2.0
// SearchService.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "client/api/packing.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

/// Servers from before SearchReply::covered search everything and say 0.
SearchReply replyTo(const SearchOptions& options, const v1::SearchResponse& response) {
    SearchReply reply = fromWire(response);
    if (!options.allowPartial || (reply.covered == 0.0 && reply.candidates > 0)) reply.covered = 1.0;
    return reply;
}

}  // namespace

Result<SearchReply> Client::searchByKey(const SearchOptions& options, const std::string& key,
                                        bool includeSelf, const RunContext& context) const {
    v1::SearchByKeyRequest request;
    fill(options, request.mutable_options());
    request.set_key(key);
    request.set_include_self(includeSelf);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->search,
                                    &v1::SearchService::Stub::SearchByKey, request);
    RETURN_IF_ERROR(response);
    return replyTo(options, *response);
}

Result<SearchReply> Client::searchByScan(const SearchOptions& options, const PointCloud& points,
                                         const RunContext& context) const {
    const auto packed = packPoints(points);
    RETURN_IF_ERROR(packed);
    v1::SearchByScanRequest request;
    v1::SearchByScanHeader* header = request.mutable_header();
    fill(options, header->mutable_options());
    fill(*packed, header);
    v1::SearchResponse response;
    const auto made = makeCall(impl_->options, context, kIdempotent, &request,
                               [&](grpc::ClientContext& rpc, Result<void>&) {
                                   response.Clear();
                                   const auto stream = impl_->search->SearchByScan(&rpc, &response);
                                   writeScan(*stream, request, *packed, context);
                                   return stream->Finish();
                               });
    RETURN_IF_ERROR(made);
    return replyTo(options, response);
}

Result<SearchReply> Client::searchBySignature(const SearchOptions& options,
                                              const std::string& encodedSignature,
                                              const RunContext& context) const {
    v1::SearchBySignatureRequest request;
    fill(options, request.mutable_options());
    request.set_signature(encodedSignature);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->search,
                                    &v1::SearchService::Stub::SearchBySignature, request);
    RETURN_IF_ERROR(response);
    return replyTo(options, *response);
}

Result<std::vector<SearchReply>> Client::searchBatch(const SearchOptions& options,
                                                     const std::vector<BatchQuery>& queries,
                                                     const RunContext& context) const {
    v1::SearchBatchRequest request;
    fill(options, request.mutable_options());
    for (const BatchQuery& query : queries) {
        if (query.signature.empty()) {
            request.add_queries()->set_key(query.key);
        } else {
            request.add_queries()->set_signature(query.signature);
        }
    }
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->search,
                                    &v1::SearchService::Stub::SearchBatch, request);
    RETURN_IF_ERROR(response);
    std::vector<SearchReply> replies;
    for (const v1::SearchResponse& one : response->responses()) {
        replies.push_back(replyTo(options, one));
    }
    return replies;
}

Result<Comparison> Client::compare(const ShapeRef& query, const ShapeRef& other,
                                   const CompareOptions& options, const RunContext& context) const {
    v1::CompareRequest request;
    fill(query, request.mutable_query());
    fill(other, request.mutable_other());
    request.set_forbid_reflection(!options.reflection);
    request.set_keep_scale(options.keepScale);
    request.set_partial(options.partial);
    request.set_free_scale(options.freeScale);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->search,
                                    &v1::SearchService::Stub::Compare, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

namespace {

// `other`: null for a stored shape, which the header names.
Result<Alignment> alignScans(const ClientOptions& options, v1::AlignService::Stub& stub,
                             v1::AlignRequest request, const PackedPoints& query, const PackedPoints* other,
                             const RunContext& context) {
    v1::AlignHeader* header = request.mutable_header();
    header->set_query_points(query.count);
    header->set_query_sha256(query.sha256);
    wire::toProto(query.origin, header->mutable_query_origin());
    if (other != nullptr) {
        header->set_other_points(other->count);
        header->set_other_sha256(other->sha256);
        wire::toProto(other->origin, header->mutable_other_origin());
    }
    v1::AlignResponse response;
    const auto made =
        makeCall(options, context, kIdempotent, &request, [&](grpc::ClientContext& rpc, Result<void>&) {
            response.Clear();
            const auto stream = stub.Align(&rpc, &response);
            if (stream->Write(request) && writeChunks<v1::AlignRequest>(*stream, query, context) &&
                (other == nullptr || writeChunks<v1::AlignRequest>(*stream, *other, context))) {
                stream->WritesDone();
            }
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    return Alignment{fromWire(response.fit()), wire::fromProto(response.unit()).value_or(LengthUnit::kNone)};
}

v1::AlignRequest alignRequest(const CompareOptions& options) {
    v1::AlignRequest request;
    request.mutable_header()->set_keep_scale(options.keepScale);
    request.mutable_header()->set_forbid_reflection(!options.reflection);
    request.mutable_header()->set_partial(options.partial);
    request.mutable_header()->set_free_scale(options.freeScale);
    return request;
}

}  // namespace

Result<Alignment> Client::align(const PointCloud& query, const ShapeRef& other, const CompareOptions& options,
                                const RunContext& context) const {
    const auto packed = packPoints(query);
    RETURN_IF_ERROR(packed);
    v1::AlignRequest request = alignRequest(options);
    fill(other, request.mutable_header()->mutable_key());
    return alignScans(impl_->options, *impl_->align, std::move(request), *packed, nullptr, context);
}

Result<Alignment> Client::align(const PointCloud& query, const PointCloud& other,
                                const CompareOptions& options, const RunContext& context) const {
    const auto packed = packPoints(query);
    RETURN_IF_ERROR(packed);
    const auto packedOther = packPoints(other);
    RETURN_IF_ERROR(packedOther);
    return alignScans(impl_->options, *impl_->align, alignRequest(options), *packed, &*packedOther, context);
}

}  // namespace shapedb::client
