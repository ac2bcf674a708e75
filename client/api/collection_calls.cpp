// SPDX-License-Identifier: Apache-2.0
// CollectionService.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

Result<Collection> Client::createCollection(const std::string& name, const std::string& description,
                                            const Parameters& parameters, const RunContext& context) const {
    v1::CreateCollectionRequest request;
    request.set_name(name);
    request.set_description(description);
    fillParameters(parameters, &request);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->collections,
                                    &v1::CollectionService::Stub::CreateCollection, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<Collection> Client::getCollection(const std::string& name, const RunContext& context) const {
    v1::GetCollectionRequest request;
    request.set_name(name);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->collections,
                                    &v1::CollectionService::Stub::GetCollection, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<std::vector<Collection>> Client::listCollections(const RunContext& context) const {
    const auto response =
        callUnary(impl_->options, context, kIdempotent, *impl_->collections,
                  &v1::CollectionService::Stub::ListCollections, v1::ListCollectionsRequest());
    RETURN_IF_ERROR(response);
    std::vector<Collection> collections;
    for (const v1::Collection& one : response->collections()) collections.push_back(fromWire(one));
    return collections;
}

Result<void> Client::deleteCollection(const std::string& name, bool force, const RunContext& context) const {
    v1::DeleteCollectionRequest request;
    request.set_name(name);
    request.set_force(force);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->collections,
                                    &v1::CollectionService::Stub::DeleteCollection, request);
    RETURN_IF_ERROR(response);
    return {};
}

Result<Collection> Client::renameCollection(const std::string& name, const std::string& newName,
                                            const RunContext& context) const {
    v1::RenameCollectionRequest request;
    request.set_name(name);
    request.set_new_name(newName);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->collections,
                                    &v1::CollectionService::Stub::RenameCollection, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<Collection> Client::setAlias(const std::string& alias, const std::string& collection,
                                    const RunContext& context) const {
    v1::SetAliasRequest request;
    request.set_alias(alias);
    request.set_collection(collection);
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->collections,
                                    &v1::CollectionService::Stub::SetAlias, request);
    RETURN_IF_ERROR(response);
    return fromWire(*response);
}

Result<void> Client::deleteAlias(const std::string& alias, const RunContext& context) const {
    v1::DeleteAliasRequest request;
    request.set_alias(alias);
    const auto response = callUnary(impl_->options, context, kOnce, *impl_->collections,
                                    &v1::CollectionService::Stub::DeleteAlias, request);
    RETURN_IF_ERROR(response);
    return {};
}

}  // namespace shapedb::client
