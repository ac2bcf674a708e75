// SearchService.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "client/api/packing.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

Result<SearchReply> Client::searchByKey(const SearchOptions& options, const std::string& key,
                                        bool includeSelf, const RunContext& context) const {
    v1::SearchByKeyRequest request;
    fill(options, request.mutable_options());
    request.set_key(key);
    request.set_include_self(includeSelf);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->search,
                                    &v1::SearchService::Stub::SearchByKey, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<SearchReply> Client::searchByScan(const SearchOptions& options, const PointCloud& points,
                                         const RunContext& context) const {
    const auto packed = packPoints(points);
    RETURN_IF_ERROR(packed);
    v1::SearchByScanRequest request;
    v1::SearchByScanHeader* header = request.mutable_header();
    SearchOptions moved = options;
    if (moved.viewpoint) moved.viewpoint = *moved.viewpoint - packed->offset;
    fill(moved, header->mutable_options());
    header->set_point_count(packed->count);
    header->set_sha256(packed->sha256);
    v1::SearchResponse response;
    const auto made =
        makeCall(impl_->options, context, kIdempotent, [&](grpc::ClientContext& rpc, Result<void>&) {
            response.Clear();
            const auto stream = impl_->search->SearchByScan(&rpc, &response);
            writeScan(*stream, request, *packed, context);
            return stream->Finish();
        });
    RETURN_IF_ERROR(made);
    SearchReply reply = fromWire(response);
    reply.offset = packed->offset;
    return reply;
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
    return fromWire(*response);
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
    for (const v1::SearchResponse& one : response->responses()) replies.push_back(fromWire(one));
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
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->search,
                                    &v1::SearchService::Stub::Compare, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

}  // namespace shapedb::client
