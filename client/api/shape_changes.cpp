// SPDX-License-Identifier: Apache-2.0
// ShapeService: changes of many shapes.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

Result<DeleteReply> Client::deleteShapes(const ShapeSelection& selection, const RunContext& context) const {
    v1::DeleteShapesRequest request;
    request.set_collection(selection.collection);
    fill(selection, request.mutable_selection());
    const auto response = callUnary(impl_->options, context, kOnceUnbounded, *impl_->shapes,
                                    &v1::ShapeService::Stub::DeleteShapes, request);
    RETURN_IF_ERROR(response);
    return DeleteReply{response->deleted(), {response->missing().begin(), response->missing().end()}};
}

Result<RetryReply> Client::retryShapes(const ShapeSelection& selection, const RunContext& context) const {
    v1::RetryShapesRequest request;
    request.set_collection(selection.collection);
    fill(selection, request.mutable_selection());
    const auto response = callUnary(impl_->options, context, kIdempotentUnbounded, *impl_->shapes,
                                    &v1::ShapeService::Stub::RetryShapes, request);
    RETURN_IF_ERROR(response);
    return RetryReply{response->queued(),
                      response->left(),
                      {response->not_failed().begin(), response->not_failed().end()},
                      {response->missing().begin(), response->missing().end()}};
}

Result<MetadataReply> Client::updateMetadata(const ShapeRef& shape, const MetadataChange& change,
                                             std::optional<std::int64_t> expectedVersion,
                                             const RunContext& context) const {
    v1::UpdateMetadataRequest request;
    request.set_collection(shape.collection);
    request.set_key(shape.key);
    fill(change, request.mutable_change());
    if (expectedVersion) request.set_expected_version(*expectedVersion);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->shapes,
                                    &v1::ShapeService::Stub::UpdateMetadata, request);
    RETURN_IF_ERROR(response);
    MetadataReply reply;
    reply.changed = response->changed();
    reply.unchanged = response->unchanged();
    reply.shape = fromWire(response->shape());
    return reply;
}

Result<MetadataReply> Client::updateMetadataWhere(const std::string& collection, const std::string& filter,
                                                  const MetadataChange& change,
                                                  const RunContext& context) const {
    v1::UpdateMetadataRequest request;
    request.set_collection(collection);
    request.set_filter(filter);
    fill(change, request.mutable_change());
    const auto response = callUnary(impl_->options, context, kOnceUnbounded, *impl_->shapes,
                                    &v1::ShapeService::Stub::UpdateMetadata, request);
    RETURN_IF_ERROR(response);
    MetadataReply reply;
    reply.changed = response->changed();
    reply.unchanged = response->unchanged();
    reply.refused = response->refused();
    reply.firstRefusedKey = response->first_refused_key();
    if (response->has_first_refused()) reply.firstRefused = fromWire(response->first_refused());
    return reply;
}

}  // namespace shapedb::client
