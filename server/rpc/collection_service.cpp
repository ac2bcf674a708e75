// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/collection_service.h"

#include "core/base/return_if_error.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"

namespace shapedb::rpc {
namespace {

/// The collection with its counts.
Result<void> fill(const Services& services, const index::Snapshot& snapshot, v1::Collection* out) {
    const auto counts = services.catalog.countShapes(snapshot);
    // A damaged collection does not hide the others in a list.
    if (!snapshot.damage) RETURN_IF_ERROR(counts);
    toProto(snapshot.collection, snapshot.parameters, out);
    if (!snapshot.parametersKnown) {
        out->clear_profile();
        out->clear_segmentation();
        out->clear_signature();
    }
    if (snapshot.damage) out->set_damage(snapshot.damage->message);
    if (counts) {
        out->set_shapes(counts->all);
        out->set_shapes_ready(counts->ready);
        out->set_shapes_failed(counts->failed);
    }
    for (const std::string& alias : services.catalog.aliasesOf(snapshot)) out->add_aliases(alias);
    return {};
}

}  // namespace

CollectionServiceHandler::CollectionServiceHandler(const Services& services) : services_(services) {
    serve("CreateCollection", this, &CollectionServiceHandler::createCollection);
    serve("GetCollection", this, &CollectionServiceHandler::getCollection);
    serve("ListCollections", this, &CollectionServiceHandler::listCollections);
    serve("RenameCollection", this, &CollectionServiceHandler::renameCollection);
    serve("SetAlias", this, &CollectionServiceHandler::setAlias);
    serve("DeleteAlias", this, &CollectionServiceHandler::deleteAlias);
    serve("DeleteCollection", this, &CollectionServiceHandler::deleteCollection);
}

grpc::Status CollectionServiceHandler::createCollection(grpc::ServerContext* context,
                                                        Request<v1::CreateCollectionRequest>& request,
                                                        v1::Collection* response) {
    return handle(
        services_, context, operations::kCreateCollection, request, [&](Call& call) -> Result<void> {
            RETURN_IF_ERROR(call.useCollection(request->name()));
            const auto wanted =
                overridesFrom(request->profile(), request->segmentation(), request->signature());
            RETURN_IF_ERROR(wanted);
            const auto parameters = wanted->ofNew();
            RETURN_IF_ERROR(parameters);
            const auto created =
                services_.catalog.createCollection(request->name(), request->description(), *parameters);
            RETURN_IF_ERROR(created);
            return fill(services_, **created, response);
        });
}

grpc::Status CollectionServiceHandler::getCollection(grpc::ServerContext* context,
                                                     Request<v1::GetCollectionRequest>& request,
                                                     v1::Collection* response) {
    return handle(services_, context, operations::kGetCollection, request, [&](Call& call) -> Result<void> {
        const auto found = call.collection(request->name());
        RETURN_IF_ERROR(found);
        return fill(services_, **found, response);
    });
}

grpc::Status CollectionServiceHandler::listCollections(grpc::ServerContext* context,
                                                       Request<v1::ListCollectionsRequest>& request,
                                                       v1::ListCollectionsResponse* response) {
    return handle(services_, context, operations::kListCollections, request, [&](Call& call) -> Result<void> {
        const auto collections = services_.catalog.collections();
        RETURN_IF_ERROR(collections);
        for (const index::SnapshotPtr& snapshot : *collections) {
            if (!call.authorization().sees(snapshot->collection.name)) continue;
            RETURN_IF_ERROR(fill(services_, *snapshot, response->add_collections()));
        }
        return {};
    });
}

grpc::Status CollectionServiceHandler::renameCollection(grpc::ServerContext* context,
                                                        Request<v1::RenameCollectionRequest>& request,
                                                        v1::Collection* response) {
    return handle(
        services_, context, operations::kRenameCollection, request, [&](Call& call) -> Result<void> {
            // The new name is asked for as if a collection were created.
            RETURN_IF_ERROR(call.useCollection(request->new_name()));
            RETURN_IF_ERROR(call.useCollection(request->name()));
            call.note({"new_name", request->new_name()});
            const auto renamed = services_.catalog.renameCollection(request->name(), request->new_name());
            RETURN_IF_ERROR(renamed);
            return fill(services_, **renamed, response);
        });
}

grpc::Status CollectionServiceHandler::setAlias(grpc::ServerContext* context,
                                                Request<v1::SetAliasRequest>& request,
                                                v1::Collection* response) {
    return handle(services_, context, operations::kSetAlias, request, [&](Call& call) -> Result<void> {
        // The alias too: the name of a collection that could be created, or what it stands for now.
        RETURN_IF_ERROR(call.useCollection(request->alias()));
        const auto collection = call.useCollection(request->collection());
        RETURN_IF_ERROR(collection);
        call.note({"alias", request->alias()});
        const auto named = services_.catalog.setAlias(request->alias(), *collection);
        RETURN_IF_ERROR(named);
        return fill(services_, **named, response);
    });
}

grpc::Status CollectionServiceHandler::deleteAlias(grpc::ServerContext* context,
                                                   Request<v1::DeleteAliasRequest>& request,
                                                   v1::DeleteAliasResponse*) {
    return handle(services_, context, operations::kDeleteAlias, request, [&](Call& call) -> Result<void> {
        RETURN_IF_ERROR(call.useCollection(request->alias()));
        return services_.catalog.deleteAlias(request->alias());
    });
}

grpc::Status CollectionServiceHandler::deleteCollection(grpc::ServerContext* context,
                                                        Request<v1::DeleteCollectionRequest>& request,
                                                        v1::DeleteCollectionResponse*) {
    return handle(services_, context, operations::kDeleteCollection, request,
                  [&](Call& call) -> Result<void> {
                      RETURN_IF_ERROR(call.useCollection(request->name()));
                      return services_.catalog.deleteCollection(request->name(), request->force());
                  });
}

}  // namespace shapedb::rpc
